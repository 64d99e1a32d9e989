// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace curlew {

/// Curves over a common x. A missing value is NaN. Rows are drawn in their order, so curves that have no x in common
/// can follow one another.
struct PlotData {
    std::string xName = {};
    std::vector<double> x = {};
    struct Curve {
        std::string name = {};
        std::vector<double> y = {}; ///< One per x.
    };
    std::vector<Curve> curves = {};
};

struct PlotOptions {
    std::string title = {}, xLabel = {}, yLabel = {}; ///< An empty xLabel shows xName.
    bool logX = false, logY = false;                  ///< Logarithmic axis; values that are not positive are not shown.
    int width = 760, height = 460;                    ///< Pixels.
};

/// Reads a CSV file (readCsv with CsvCells::optional): the first column is x, every other column a curve; empty cells
/// are missing values. Throws FileError like readCsv, and if there is only one column or no row.
PlotData readPlotData(const std::filesystem::path& path);

/// Returns the curves as an SVG with axes, round tick values, a grid and a legend; curves with few points get markers.
/// From the eighth curve on, colours repeat, and lines are dashed.
/// The same data give the same bytes. Throws ValueError if nothing can be shown, the width or height is not 200 to
/// 10000 pixels, or array lengths differ.
std::string plotSvg(const PlotData& data, const PlotOptions& options = {});

} // namespace curlew
