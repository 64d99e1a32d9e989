// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace curlew {

/// Curves over one x. A value that is missing is NaN.
struct PlotData {
    std::string xName = {};
    std::vector<double> x = {};
    struct Curve {
        std::string name = {};
        std::vector<double> y = {}; ///< One for each x.
    };
    std::vector<Curve> curves = {};
};

struct PlotOptions {
    std::string title = {}, xLabel = {}, yLabel = {}; ///< Without an xLabel: the name of x.
    bool logX = false, logY = false;                  ///< Decades; what is not positive is not shown.
    int width = 760, height = 460;                    ///< Pixels.
};

/// The table of a CSV file (readCsv with CsvCells::optional): the first column is x, each other one a curve; empty
/// cells are missing. Throws FileError as readCsv does, and if there is a single column or no row.
PlotData readPlotData(const std::filesystem::path& path);

/// The curves as an SVG, with axes, round numbers at them, a grid and a legend; markers on curves of few points. The
/// same data give the same bytes. Throws ValueError where nothing can be shown, for a size below 200 and arrays of
/// different lengths.
std::string plotSvg(const PlotData& data, const PlotOptions& options = {});

} // namespace curlew
