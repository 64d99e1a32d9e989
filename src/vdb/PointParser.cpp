// SPDX-License-Identifier: Apache-2.0
#include "MeshParser.h"
#include "PointArrays.h"
#include "curlew/base/InputFile.h"
#include "curlew/base/LocalFile.h"
#include "curlew/base/Memory.h"
#include "curlew/vdb/PointFile.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

namespace curlew {

namespace {

constexpr double kLargestId = 9007199254740992; // 2^53: doubles represent all integers up to here

std::string shortened(std::string text) {
    constexpr size_t kMost = 80;
    return text.size() > kMost ? text.substr(0, kMost) + " …" : text;
}

/// Converts the columns of a table to arrays of points.
class Columns {
  public:
    Columns(const CsvTable& table, std::filesystem::path path) : mTable(table), mPath(std::move(path)) {
        std::set<std::string> names;
        for (const std::string& name : table.names)
            if (!names.insert(name).second) throw error(fmt::format("it has the column {} twice", name));
    }

    size_t rows() const { return mTable.values.size() / std::max<size_t>(mTable.names.size(), 1); }

    /// Fills arrays with the columns of these names. Throws FileError if some are missing, unless all are missing and
    /// they are not `needed`.
    template <class T>
    void take(const std::vector<std::pair<const char*, std::vector<T>*>>& columns, bool needed = false) {
        std::vector<size_t> found;
        std::string missing;
        for (const auto& [name, array] : columns) {
            const auto at = std::find(mTable.names.begin(), mTable.names.end(), name);
            if (at != mTable.names.end()) found.push_back(static_cast<size_t>(at - mTable.names.begin()));
            if (at == mTable.names.end() && missing.empty()) missing = name;
        }
        if (found.empty() && !needed) return;
        if (!missing.empty())
            throw error(fmt::format("it has no column {}; its columns are {}", missing,
                                    shortened(fmt::format("{}", fmt::join(mTable.names, ",")))));
        for (size_t k = 0; k < columns.size(); ++k) {
            if (!mTable.text.empty() && !mTable.text[found[k]].empty()) throw error(mTable.text[found[k]]);
            mTaken.insert(columns[k].first);
            for (size_t row = 0; row < rows(); ++row) columns[k].second->push_back(converted<T>(value(row, found[k])));
        }
    }

    std::vector<std::string> skipped() const {
        std::vector<std::string> names;
        for (const std::string& name : mTable.names)
            if (!mTaken.contains(name)) names.push_back(name);
        return names;
    }

    FileError error(const std::string& what) const {
        return FileError(fmt::format("'{}' cannot be read as points: {}", mPath.string(), what));
    }

  private:
    double value(size_t row, size_t column) const { return mTable.values[row * mTable.names.size() + column]; }

    template <class T>
    T converted(double number) const {
        if constexpr (std::is_integral_v<T>)
            if (!(std::abs(number) <= kLargestId) || number != std::floor(number))
                throw error(fmt::format("it has the id {:g}, which is not a whole number up to 2^53", number));
        return static_cast<T>(number);
    }

    const CsvTable& mTable;
    std::filesystem::path mPath;
    std::set<std::string> mTaken;
};

PointTable pointsOf(const CsvTable& table, const std::filesystem::path& path) {
    Columns columns(table, path);
    // At most 8 bytes for each number, and for an id that the file does not have.
    requireMemory(8 * static_cast<double>((table.names.size() + 1) * columns.rows()),
                  fmt::format("'{}'", path.string()), "split the file");
    PointTable result;
    Points& p = result.points;
    columns.take<double>({{"x", &p.x}, {"y", &p.y}, {"z", &p.z}}, true);
    columns.take<float>({{"vx", &p.vx}, {"vy", &p.vy}, {"vz", &p.vz}});
    columns.take<int64_t>({{"id", &p.id}});
    columns.take<double>({{"f", &p.f}, {"g", &p.g}});
    columns.take<float>({{"age", &p.age}});
    columns.take<float>({{"life", &p.life}});
    columns.take<float>({{"fade", &p.fade}});
    if (p.id.empty())
        for (size_t n = 0; n < p.size(); ++n) p.id.push_back(static_cast<int64_t>(n));
    size_t bad = 0;
    for (size_t n = 0; n < p.size(); ++n)
        bad += !(std::isfinite(p.x[n]) && std::isfinite(p.y[n]) && std::isfinite(p.z[n]));
    if (bad > 0)
        throw columns.error(
            fmt::format("{} of its {} points have a coordinate that is not a finite number; repair "
                        "them",
                        bad, p.size()));
    result.skipped = columns.skipped();
    return result;
}

} // namespace

PointTable readPoints(const std::filesystem::path& path, const Monitor& monitor) {
    if (endingOf(path) == ".csv") return pointsOf(readCsv(path, CsvCells::text, {}, monitor), path);
    const MeshSource source{path, monitor, "points"};
    const PlyVertices vertices = parsePlyVertices(contentOf(path), source);
    if (!vertices.edges.empty()) throw source.error("it holds curves; give points");
    return pointsOf(vertices.table, path);
}

PlyContent contentOfPly(const std::filesystem::path& path) {
    constexpr size_t kLongestHeader = size_t{1} << 16;
    std::ifstream in = openToRead(path);
    in.exceptions(std::ios::goodbit);
    std::string header(kLongestHeader, '\0');
    in.read(header.data(), static_cast<std::streamsize>(header.size()));
    std::string_view rest(header.data(), static_cast<size_t>(in.gcount()));
    PlyContent content = PlyContent::points;
    while (!rest.empty()) {
        std::string_view line = takeLine(rest);
        const std::string_view keyword = takeWord(line), element = takeWord(line);
        if (keyword == "end_header") break;
        int64_t count = 0;
        if (keyword != "element" || !parse(takeWord(line), count) || count <= 0) continue;
        if (element == "face") return PlyContent::mesh;
        if (element == "edge") content = PlyContent::curves;
    }
    return content;
}

} // namespace curlew
