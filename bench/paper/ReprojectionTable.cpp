// SPDX-License-Identifier: Apache-2.0
#include "Contained.h"
#include "Tables.h"

#include <fmt/format.h>

namespace curlew::paper {

namespace {

constexpr double kTime = 2;

struct Row {
    const char* name;
    AdvectOptions options;
};
const std::array<Row, 5> kRows{{{"the default", {.time = kTime}},
                                {"RK4, 100 steps", {.time = kTime, .steps = 100}},
                                {"RK4, 10 steps", {.time = kTime, .steps = 10}},
                                {"Euler, 100 steps", {.time = kTime, .steps = 100, .scheme = Scheme::euler}},
                                {"Euler, 10 steps", {.time = kTime, .steps = 10, .scheme = Scheme::euler}}}};

/// Returns the number of points that are not inside.
size_t outside(const Flow& flow, const Points& points) {
    size_t count = 0;
    const Wall& wall = *flow.domain().wall;
    for (size_t k = 0; k < points.size(); ++k)
        count += !(beyondWall(wall.side, wall.sdf.distance.at<0>(points.position(k)).value) < 0);
    return count;
}

} // namespace

std::vector<std::string> reprojectionTable(const TableRun& run, std::ostream& out) {
    const auto count = std::max<size_t>(64, static_cast<size_t>(1e5 * run.scale));
    const Flow flow = containedFlow(spotSdf());
    const Points start = scatter(flow.domain(), count, 7);
    Points exact = start;
    advect(flow, exact, {.time = kTime, .reprojection = {.tolerance = 1e-11}, .accuracy = 1e-9});
    out << fmt::format(
        "## The effect of reprojection\n\n{} points in spot after {} s, in the flow of the guide's main example, with "
        "and without reprojection.\n\n"
        "| | outside, with | outside, without | distance from the track (f / g), with | distance from the track (f / "
        "g), without | position error, with | position error, without |\n|---|---|---|---|---|---|---|\n",
        count, kTime);
    std::vector<std::string> broken;
    for (const Row& row : kRows) {
        std::array<AdvectResult, 2> results;
        std::array<Apart, 2> off;
        std::array<size_t, 2> left{};
        for (const size_t free : {0, 1}) {
            AdvectOptions options = row.options;
            if (free == 1) options.reprojection.method = Reprojection::none;
            Points points = start;
            results[free] = advect(flow, points, options);
            off[free] = apart(points, exact);
            left[free] = outside(flow, points);
        }
        const auto& [with, without] = results;
        out << fmt::format("| {} | {} | {} | {:.1e} / {:.1e} | {:.2g} / {:.2g} | {:.1e} | {:.1e} |\n", row.name,
                           left[0], left[1], with.residual[0], with.residual[1], without.residual[0],
                           without.residual[1], off[0].mean, off[1].mean);
        if (left[0] > 0) broken.push_back(fmt::format("{}: {} points are outside", row.name, left[0]));
        if (with.notConverged > 0)
            broken.push_back(fmt::format("{}: {} points did not converge", row.name, with.notConverged));
    }
    return broken;
}

} // namespace curlew::paper
