// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Csv.h"

#include "curlew/base/Error.h"
#include "curlew/base/InputFile.h"
#include "curlew/base/Memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <string_view>
#include <vector>

namespace curlew {

namespace {

/// The text between two commas.
std::string cellOf(std::string_view text, CsvCells cells) {
    std::string cell(text);
    if (cells == CsvCells::finite) return cell;
    std::erase(cell, '"');
    cell.erase(0, std::min(cell.find_first_not_of(" \t"), cell.size()));
    cell.erase(cell.find_last_not_of(" \t") + 1);
    return cell;
}

std::vector<std::string> cellsOf(std::string_view line, CsvCells cells) {
    std::vector<std::string> row;
    for (size_t begin = 0;;) {
        const size_t end = std::min(line.find(',', begin), line.size());
        row.push_back(cellOf(line.substr(begin, end - begin), cells));
        if (end == line.size()) return row;
        begin = end + 1;
    }
}

/// Returns false if the cell is not a number of this kind.
bool parse(std::string_view cell, CsvCells cells, double& value) {
    value = std::numeric_limits<double>::quiet_NaN();
    if (cell.empty()) return cells != CsvCells::finite;
    if (cell.starts_with('+') && !cell.starts_with("+-")) cell.remove_prefix(1);
    const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    return error == std::errc() && end == cell.data() + cell.size() &&
           (cells != CsvCells::finite || std::isfinite(value));
}

/// Returns an upper bound of the number of cells in a file, and rewinds it.
size_t cellCount(std::ifstream& in) {
    std::vector<char> buffer(1 << 16);
    size_t cells = 1;
    do {
        in.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
        const auto end = buffer.begin() + in.gcount();
        cells += static_cast<size_t>(std::count(buffer.begin(), end, ',') + std::count(buffer.begin(), end, '\n'));
    } while (in);
    in.clear();
    in.seekg(0);
    return cells;
}

} // namespace

CsvTable readCsv(const std::filesystem::path& path, CsvCells cells,
                 const std::function<void(const std::vector<std::string>& names)>& checkNames, const Monitor& monitor) {
    std::ifstream in = openToRead(path);
    in.exceptions(std::ios::goodbit);
    const size_t most = cellCount(in);
    requireMemory(static_cast<double>(most) * sizeof(double), fmt::format("'{}'", path.string()), "split the file");
    CsvTable table;
    table.values.reserve(most);
    std::string line;
    for (size_t number = 1; std::getline(in, line); ++number) {
        if (number % 4096 == 0) monitor.check();
        std::erase(line, '\r');
        if (number == 1 && line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3); // as spreadsheets write it
        if (line.find_first_not_of(" \t") == std::string::npos) continue;
        const auto row = cellsOf(line, cells);
        if (table.names.empty()) {
            table.names = row;
            table.text.resize(row.size());
            if (checkNames) checkNames(row);
            continue;
        }
        const auto wrong = [&](const std::string& what) {
            return FileError(fmt::format("cannot read '{}': line {}: {}", path.string(), number, what));
        };
        if (row.size() != table.names.size())
            throw wrong(fmt::format("{} cells, but the header has {}", row.size(), table.names.size()));
        for (size_t column = 0; column < row.size(); ++column) {
            double& value = table.values.emplace_back();
            if (parse(row[column], cells, value)) continue;
            const std::string what =
                fmt::format("'{}' is not a {}number", row[column], cells == CsvCells::finite ? "finite " : "");
            if (cells != CsvCells::text) throw wrong(what);
            value = std::numeric_limits<double>::quiet_NaN();
            if (table.text[column].empty()) table.text[column] = fmt::format("line {}: {}", number, what);
        }
    }
    if (in.bad()) throw FileError(fmt::format("cannot read '{}': the disk or network failed", path.string()));
    if (table.names.empty()) throw FileError(fmt::format("cannot read '{}': it has only blank lines", path.string()));
    return table;
}

} // namespace curlew
