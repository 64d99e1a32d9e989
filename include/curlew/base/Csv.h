// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace curlew {

/// Numbers in named columns.
struct CsvTable {
    std::vector<std::string> names;
    std::vector<double> values; ///< Row by row, one for each name.
};

/// What the cells of a CSV file may hold.
enum class CsvCells {
    finite,  ///< Finite numbers, without spaces or quotes.
    optional ///< Any numbers; an empty cell is NaN. Spaces around a name or number, and all double quotes, are ignored.
};

/// Reads a CSV file: names in its first line, then rows with a number for each of them, separated by commas. Blank
/// lines and carriage returns are skipped. `checkNames` sees the names before the first row is read, and throws if the
/// file is not the one that the caller expects. Throws FileError, naming file and line, if the file cannot be read, is
/// blank, or has a row of another length than the header or a cell that is not a number; ResourceError if the table
/// would not fit into memory.
CsvTable readCsv(const std::filesystem::path& path, CsvCells cells,
                 const std::function<void(const std::vector<std::string>& names)>& checkNames = {});

} // namespace curlew
