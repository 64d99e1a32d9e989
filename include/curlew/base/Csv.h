// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace curlew {

/// Numbers in named columns.
struct CsvTable {
    std::vector<std::string> names;
    std::vector<double> values; ///< Row by row, one value per name.
    /// For each name, where its first cell is that is not a number; empty if there is none. Only CsvCells::text allows
    /// one.
    std::vector<std::string> text;
};

/// What the cells of a CSV file may hold.
enum class CsvCells {
    finite,   ///< Finite numbers, without spaces or quotes.
    optional, ///< Any numbers; an empty cell is NaN. Spaces around a name or number and all double quotes are ignored.
    text      ///< The same, and any text without commas, which is NaN.
};

/// Reads a CSV file. The first line holds the names; each following row holds one number per name, separated by commas.
/// Blank lines, carriage returns and a byte order mark are skipped. `checkNames` is called with the names before the
/// first row is read, and throws if this is not the file that the caller expects. Throws FileError, naming file and
/// line, if the file cannot be read or is blank, if a row and the header differ in length, or if a cell is not a
/// number. Throws ResourceError if the table would not fit into memory; Interrupted.
CsvTable readCsv(const std::filesystem::path& path, CsvCells cells,
                 const std::function<void(const std::vector<std::string>& names)>& checkNames = {},
                 const Monitor& monitor = {});

} // namespace curlew
