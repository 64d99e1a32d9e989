// SPDX-License-Identifier: Apache-2.0
#include "Tables.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flows.h"
#include "curlew/flow/Wind.h"
#include "curlew/track/Advect.h"
#include "curlew/track/Distance.h"
#include "curlew/track/Scatter.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string_view>

namespace curlew::paper {

namespace {

struct Setting {
    std::string_view name;
    Flow flow;
};

ScalarField noise(uint64_t seed) { return noiseField<Psrd3>({.seed = seed}, {.frequency = 1.5}); }

/// Returns sums in the unit ball whose terms are tangent to its boundary and have speed 1.
std::vector<Setting> settings() {
    const Wall wall{.sdf = sphereSdf(1), .side = Side::inside, .width = 0.2};
    const Domain domain = Domain::of(wall);
    const ScalarField ramp = (2 / wall.width) * clipped(wall.sdf.distance, wall.width);
    const Flow bound = withSpeed(Flow(noise(1), bounded(noise(2), wall), domain), 1);
    const Flow curl = withSpeed(curlFlow(std::array{ramp * noise(3), ramp * noise(4), ramp * noise(5)}, domain), 1);
    Wall room = wall;
    room.width = 0.5;
    return {{"noise and wind, 2 terms", withSpeed(bound + windFlow(room, {}), 1)},
            {"curl noise, 3 terms", curl},
            {"both kinds of noise, 4 terms", withSpeed(bound + curl, 1)}};
}

struct Row {
    Splitting splitting;
    int steps;
    AdvectResult result{};
    double mean = 0, seconds = 0;
};

constexpr double kTime = 1;

Row measured(const Flow& flow, const Points& start, const Points& reference, Splitting splitting, int steps) {
    Row row{.splitting = splitting, .steps = steps};
    Points particles = start;
    const auto begin = std::chrono::steady_clock::now();
    row.result = advect(flow, particles, {.time = kTime, .steps = steps, .splitting = splitting});
    row.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    row.mean = distanceBetween(particles, reference).mean;
    return row;
}

std::string_view nameOf(Splitting splitting) {
    return splitting == Splitting::none ? "as a whole" : kSplittingNames.at(static_cast<size_t>(splitting));
}

/// Adds the claims that do not hold.
void judge(std::string_view setting, const Row& row, std::vector<std::string>& broken) {
    if (row.splitting == Splitting::none) return;
    if (row.result.outside > 0)
        broken.push_back(fmt::format("{}, {}, {} steps: {} points are outside", setting, nameOf(row.splitting),
                                     row.steps, row.result.outside));
    if (const double drift = std::max(row.result.drift[0], row.result.drift[1]);
        drift > AdvectOptions{}.reprojection.tolerance * (1 + 1e-9))
        broken.push_back(
            fmt::format("{}, {}, {} steps: labels drift by {:.3g}", setting, nameOf(row.splitting), row.steps, drift));
}

} // namespace

std::vector<std::string> splittingTable(const TableRun& run, std::ostream& out) {
    const auto count = static_cast<size_t>(std::max(100.0, std::round(5000 * run.scale)));
    out << fmt::format(
        "## Sums in a wall, as a whole and by splitting\n\n{} points in the unit ball, time {}, RK4. The width of the "
        "layer is 0.2 (0.5 for the wind), the noises have the frequency 1.5, and the rms speed is 1. Distances are "
        "relative to the result of 2000 RK4 steps of the sum as a whole. Drift is the maximum over all labels of all "
        "terms and over all substeps, relative to the label's rms.\n\n",
        count, kTime);
    out << "| sum | followed | steps | outside | mean distance | drift | not converged | seconds |\n"
           "|---|---|---|---|---|---|---|---|\n";
    std::vector<std::string> broken;
    for (const auto& [name, flow] : settings()) {
        const Points start = scatter(flow.domain(), count, 1);
        Points reference = start;
        advect(flow, reference, {.time = kTime, .steps = 2000, .splitting = Splitting::none});
        for (const Splitting splitting : {Splitting::none, Splitting::strang, Splitting::yoshida})
            for (const int steps : {2, 5, 20, 80}) {
                const Row row = measured(flow, start, reference, splitting, steps);
                judge(name, row, broken);
                out << fmt::format("| {} | {} | {} | {} | {:.2g} | {:.1e} | {} | {:.2g} |\n", name, nameOf(splitting),
                                   steps, row.result.outside, row.mean,
                                   std::max(row.result.drift[0], row.result.drift[1]), row.result.notConverged,
                                   row.seconds);
            }
    }
    return broken;
}

} // namespace curlew::paper
