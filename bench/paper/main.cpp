// SPDX-License-Identifier: Apache-2.0
#include "Tables.h"
#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <iostream>
#include <iterator>
#include <string_view>

namespace {

using namespace curlew;
using namespace curlew::paper;

struct Table {
    std::string_view name;
    std::vector<std::string> (*write)(const TableRun&, std::ostream&);
};
constexpr Table kTables[] = {
    {"jitter", jitterTable},     {"sampling", samplingTable}, {"warp", warpTable},
    {"torus", torusTable},       {"time", timeTable},         {"reprojection", reprojectionTable},
    {"layer", layerTable},       {"loop", loopTable},         {"splitting", splittingTable},
    {"spectrum", spectrumTable}, {"gridflow", gridFlowTable},
};

/// Throws ValueError with the reason, followed by the usage.
[[noreturn]] void fail(const std::string& what) {
    std::string names;
    for (const Table& table : kTables) names += fmt::format("{}|", table.name);
    throw ValueError(fmt::format("{}; usage: curlew_paper {}list [--scale S] [--folder F], 0 < S <= 1", what, names));
}

double scaleOf(std::string_view text) {
    double scale = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), scale);
    if (error != std::errc() || end != text.data() + text.size() || !(scale > 0 && scale <= 1))
        fail(fmt::format("--scale {}", text));
    return scale;
}

/// Returns the exit code: 1 if a claim does not hold.
int run(const std::vector<std::string>& arguments) {
    const auto* table = std::find_if(std::begin(kTables), std::end(kTables),
                                     [&](const Table& t) { return !arguments.empty() && t.name == arguments[0]; });
    if (arguments == std::vector<std::string>{"list"}) {
        for (const Table& known : kTables) fmt::print("{}\n", known.name);
        return 0;
    }
    if (table == std::end(kTables)) fail(arguments.empty() ? "no table" : fmt::format("no table '{}'", arguments[0]));
    if (arguments.size() % 2 == 0) fail(fmt::format("'{}' has no value", arguments.back()));
    TableRun run;
    for (size_t k = 1; k < arguments.size(); k += 2) {
        if (arguments[k] == "--scale")
            run.scale = scaleOf(arguments[k + 1]);
        else if (arguments[k] == "--folder")
            run.folder = arguments[k + 1];
        else
            fail(fmt::format("no option '{}'", arguments[k]));
    }
    std::filesystem::create_directories(run.folder);
    const auto broken = table->write(run, std::cout);
    for (const auto& line : broken) fmt::print(stderr, "curlew_paper: {}: {}\n", table->name, line);
    return broken.empty() ? 0 : 1;
}

} // namespace

int main(int argc, char** argv) {
    try {
        return run({argv + 1, argv + argc});
    } catch (const std::exception& e) {
        fmt::print(stderr, "curlew_paper: {}\n", e.what());
        return 2;
    }
}
