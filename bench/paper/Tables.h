// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <ostream>
#include <string>
#include <vector>
namespace curlew::paper {
struct TableRun {
    double scale = 1;                     ///< 1: as in the paper; less: fewer points or pixels, for the tests.
    std::filesystem::path folder = "out"; ///< Folder for pictures and plot data.
};
/// Each function writes its table to `out` in Markdown, with the paper's figures beside ours, and returns the claims
/// that do not hold, one per line.
std::vector<std::string> jitterTable(const TableRun& run, std::ostream& out);    // ICN Table 1
std::vector<std::string> samplingTable(const TableRun& run, std::ostream& out);  // ICN §6.1: sampling and integration
std::vector<std::string> warpTable(const TableRun& run, std::ostream& out);      // ICN Table 2
std::vector<std::string> torusTable(const TableRun& run, std::ostream& out);     // ICN Fig. 6
std::vector<std::string> layerTable(const TableRun& run, std::ostream& out);     // ICN Eq. 13
std::vector<std::string> loopTable(const TableRun& run, std::ostream& out);      // -advect loop=
std::vector<std::string> splittingTable(const TableRun& run, std::ostream& out); // docs/math.md, Sums
std::vector<std::string> gridFlowTable(const TableRun& run, std::ostream& out);  // docs/math.md, Grids
std::vector<std::string> timeTable(const TableRun& run, std::ostream& out); // accuracy in time and cost of the steppers
std::vector<std::string> spectrumTable(const TableRun& run, std::ostream& out);     // docs/math.md, Turbulence
std::vector<std::string> reprojectionTable(const TableRun& run, std::ostream& out); // the README's results
} // namespace curlew::paper
