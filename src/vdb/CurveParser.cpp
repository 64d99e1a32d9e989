// SPDX-License-Identifier: Apache-2.0
#include "MeshParser.h"
#include "curlew/vdb/CurveFile.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace curlew {

namespace fs = std::filesystem;

namespace {

FileError noCurves(const fs::path& path, const std::string& what) {
    return FileError(fmt::format("'{}' cannot be read as curves: {}", path.string(), what));
}

/// Joins edges to curves. Throws FileError, naming the file, as curvesOf() throws ValueError.
Curves joinedCurves(const fs::path& path, const std::vector<Vec3d>& vertices, const std::vector<CurveEdge>& edges,
                    const std::vector<int64_t>& ids = {}) {
    try {
        return curvesOf(vertices, edges, ids);
    } catch (const ValueError& error) {
        throw noCurves(path, error.what());
    }
}

/// Reads the points (`v`) and polylines (`l`) of an .obj. If all polylines have two vertices, they are edges.
Curves readObjCurves(const fs::path& path) {
    std::string text = contentOf(path);
    unifyLines(text);
    std::string_view rest = text;
    std::vector<Vec3d> points;
    std::vector<Polyline> polylines;
    std::vector<CurveEdge> edges; // the lines of two vertices
    for (size_t number = 1; !rest.empty(); ++number) {
        const auto fail = [&](const std::string& what) {
            return noCurves(path, fmt::format("line {} {}", number, what));
        };
        std::string_view line = takeLine(rest);
        line = line.substr(0, line.find('#'));
        const std::string_view keyword = takeWord(line);
        if (keyword == "v") {
            Vec3d& p = points.emplace_back();
            for (int axis = 0; axis < 3; ++axis)
                if (!parse(takeWord(line), p[axis]) || !std::isfinite(p[axis]))
                    throw fail("has a point with a coordinate that is not a finite number");
        } else if (keyword == "l") {
            Polyline polyline{.id = static_cast<int64_t>(polylines.size())};
            int64_t first = 0, last = 0;
            for (std::string_view word = takeWord(line); !word.empty(); word = takeWord(line)) {
                int64_t index = 0;
                const auto count = static_cast<int64_t>(points.size());
                if (!parse(word.substr(0, word.find('/')), index) || index == 0 || index < -count || index > count)
                    throw fail(fmt::format("has a curve with the vertex '{}', but there are {} points before it", word,
                                           count));
                last = index > 0 ? index : count + 1 + index;
                if (polyline.points.empty()) first = last;
                polyline.points.push_back(points[static_cast<size_t>(last - 1)]);
            }
            if (polyline.points.size() < 2) throw fail("has a curve with fewer than 2 vertices");
            if (polyline.points.size() == 2)
                edges.push_back({static_cast<uint32_t>(first - 1), static_cast<uint32_t>(last - 1)});
            if (polyline.points.size() > 3 && first == last) {
                polyline.closed = true;
                polyline.points.pop_back();
            }
            polylines.push_back(std::move(polyline));
        }
    }
    if (polylines.empty()) throw noCurves(path, "it has no curves (lines that begin with l)");
    return edges.size() == polylines.size() ? joinedCurves(path, points, edges) : curvesOf(polylines);
}

/// Reads the columns curve, x, y, z and, if there is one, closed.
Curves readCsvCurves(const fs::path& path) {
    std::map<std::string, size_t> columns;
    const CsvTable table = readCsv(path, CsvCells::finite, [&](const std::vector<std::string>& names) {
        for (size_t k = 0; k < names.size(); ++k) columns.emplace(names[k], k);
        for (const char* name : {"curve", "x", "y", "z"})
            if (!columns.contains(name))
                throw noCurves(path, fmt::format("its first line must name the columns curve, x, y and z; there is "
                                                 "no {}",
                                                 name));
    });
    const size_t width = table.names.size();
    std::vector<Polyline> polylines;
    for (size_t row = 0; row < table.values.size(); row += width) {
        const auto cell = [&](const char* name) { return table.values[row + columns.at(name)]; };
        const double id = cell("curve");
        if (id != std::floor(id) || std::abs(id) > 0x1p53)
            throw noCurves(path, fmt::format("row {} has the curve {}, which is not an integer", row / width + 1, id));
        if (polylines.empty() || polylines.back().id != static_cast<int64_t>(id))
            polylines.push_back(
                {.closed = columns.contains("closed") && cell("closed") != 0, .id = static_cast<int64_t>(id)});
        polylines.back().points.push_back({{cell("x"), cell("y"), cell("z")}});
    }
    if (polylines.empty()) throw noCurves(path, "it has no rows");
    return curvesOf(polylines);
}

/// Reads the edges of a .ply, and the positions and curve numbers of its vertices.
Curves readPlyCurves(const fs::path& path) {
    const PlyVertices given = parsePlyVertices(contentOf(path), MeshSource{.path = path, .kind = "curves"});
    if (given.edges.empty()) throw noCurves(path, "it has no curves (element edge)");
    const std::vector<std::string>& names = given.table.names;
    const auto column = [&](const char* name) {
        return static_cast<size_t>(std::find(names.begin(), names.end(), name) - names.begin());
    };
    const size_t x = column("x"), y = column("y"), z = column("z"), curve = column("curve");
    std::vector<Vec3d> vertices;
    std::vector<int64_t> ids;
    for (const double* row = given.table.values.data(); row != given.table.values.data() + given.table.values.size();
         row += names.size()) {
        vertices.push_back({{row[x], row[y], row[z]}});
        if (curve < names.size()) ids.push_back(std::abs(row[curve]) < 0x1p53 ? static_cast<int64_t>(row[curve]) : 0);
    }
    return joinedCurves(path, vertices, given.edges, ids);
}

} // namespace

Curves readCurves(const fs::path& path) {
    const std::string extension = extensionOf(path);
    if (extension == ".ply") return readPlyCurves(path);
    return extension == ".csv" ? readCsvCurves(path) : readObjCurves(path);
}

bool holdsCurves(const fs::path& path) {
    if (extensionOf(path) == ".ply") return contentOfPly(path) == PlyContent::curves;
    std::string text = contentOf(path);
    std::string_view rest = text;
    if (extensionOf(path) == ".csv") return takeLine(rest).substr(0, 6) == "curve,";
    unifyLines(text);
    rest = text;
    bool lines = false;
    while (!rest.empty()) {
        std::string_view line = takeLine(rest);
        const std::string_view keyword = takeWord(line);
        if (keyword == "f") return false;
        lines = lines || keyword == "l";
    }
    return lines;
}

} // namespace curlew
