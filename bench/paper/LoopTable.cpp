// SPDX-License-Identifier: Apache-2.0
#include "Tables.h"
#include "curlew/field/NoiseField.h"
#include "curlew/track/Advect.h"
#include "curlew/track/Loop.h"
#include "curlew/track/Scatter.h"
#include "curlew/vdb/LevelSet.h"

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <functional>

namespace curlew::paper {

namespace {

constexpr double kFrames = 48;
constexpr int kReferenceSteps = 2000;
constexpr size_t kReferences = 500;                           ///< Number of particles that are compared with RK4.
constexpr std::array<double, 4> kPaces{0.8, 0.95, 1.05, 1.2}; ///< Boundaries between the bins of the histogram.

struct Place {
    std::string name;
    Sdf sdf;
    double width, frequency;
    double size; ///< Size of the object, world units.
};

std::vector<Place> places() {
    const auto mesh = std::make_shared<const Mesh>(readMesh(CURLEW_SCENES "/spot.obj"));
    const Sdf spot = sdfOf(widened(meshToLevelSet(mesh, {.dim = 128}), 32));
    return {
        {"sphere", sphereSdf(1), 0.15, 2, 2}, {"torus", torusSdf(0.8, 0.35), 0.1, 3, 2.3}, {"spot", spot, 0.1, 3, 2}};
}

/// Returns a flow with rms speed 1 inside the object.
Flow flowIn(const Place& place) {
    const Wall wall{.sdf = place.sdf, .side = Side::inside, .width = place.width};
    return withSpeed(
        Flow(noiseField<Psrd3>({.seed = 1}, {.frequency = place.frequency}),
             bounded(noiseField<Psrd3>({.seed = 2}, {.frequency = place.frequency}), wall), Domain::of(wall)),
        1);
}

double secondsOf(const std::function<void()>& work) {
    const auto began = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
}

/// Returns the mean and the largest distance of looped particles from the results of RK4, at 3/8 of the loop.
std::pair<double, double> errorOf(const Flow& flow, const Points& seeds, const LoopedPoints& loops, double duration) {
    constexpr double kPart = 0.375;
    const Points found = loops.at(kPart * duration).points;
    Points some, expected;
    for (size_t k = 0; k < seeds.size() && some.size() < kReferences; ++k) {
        if (loops.kind(k) != LoopKind::closed) continue;
        for (auto [points, from] : {std::pair(&some, &seeds), std::pair(&expected, &found)})
            points->x.push_back(from->x[k]), points->y.push_back(from->y[k]), points->z.push_back(from->z[k]),
                points->id.push_back(from->id[k]);
        const double rounds = loops.pace(k) * kPart * duration / loops.period(k);
        some.age.push_back(static_cast<float>((rounds - std::floor(rounds)) * loops.period(k)));
    }
    advect(flow, some, {.time = 4.0 / 3 * duration, .steps = kReferenceSteps, .byAge = true});
    double mean = 0, most = 0;
    for (size_t k = 0; k < some.size(); ++k) {
        const double distance = length(some.position(k) - expected.position(k));
        mean += distance;
        most = std::max(most, distance);
    }
    return {mean / static_cast<double>(std::max<size_t>(some.size(), 1)), most};
}

bool same(const Points& a, const Points& b) {
    return a.x == b.x && a.y == b.y && a.z == b.z && a.vx == b.vx && a.vy == b.vy && a.vz == b.vz && a.fade == b.fade;
}

} // namespace

std::vector<std::string> loopTable(const TableRun& run, std::ostream& out) {
    const auto count = static_cast<size_t>(20000 * run.scale);
    std::vector<std::string> broken;
    out << fmt::format(
        "{} particles in flows of rms speed 1 (psrd noise), with the default accuracy. Pace: the shares of closed "
        "tracks with a pace below 0.8, 0.95, 1.05, 1.2, and above. Error: the distance of a particle from the position "
        "that RK4 with {} steps gives, relative to the object's size. Times are from one machine with two threads.\n\n",
        count, kReferenceSteps);
    out << "| | loop, s | closed | faded | pace, % | gap | mean error | max error | vertices | kB each | preparation, "
           "s | frame 1, s | frame 48, s |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    for (const Place& place : places()) {
        const Flow flow = flowIn(place);
        const Points seeds = scatter(flow.domain(), count, 1);
        for (const double duration : {1.0, 2.0, 4.0, 8.0}) {
            std::optional<LoopedPoints> loops;
            const double found = secondsOf([&] { loops.emplace(flow, seeds, LoopOptions{.duration = duration}); });
            LoopMoment first, last;
            const double firstTime = secondsOf([&] { first = loops->at(duration / kFrames); });
            const double lastTime = secondsOf([&] { last = loops->at(duration * (1 - 1 / kFrames)); });
            const LoopSummary& s = loops->summary();
            std::array<size_t, kPaces.size() + 1> bins{};
            for (size_t k = 0; k < seeds.size(); ++k)
                if (loops->kind(k) == LoopKind::closed)
                    ++bins[static_cast<size_t>(std::upper_bound(kPaces.begin(), kPaces.end(), loops->pace(k)) -
                                               kPaces.begin())];
            const auto share = [&](size_t n, size_t of) {
                return 100.0 * static_cast<double>(n) / static_cast<double>(of);
            };
            std::string paces;
            for (const size_t bin : bins) paces += fmt::format("{:.0f} ", share(bin, std::max<size_t>(s.closed, 1)));
            const auto [mean, most] = errorOf(flow, seeds, *loops, duration);
            out << fmt::format(
                "| {} | {} | {:.1f} % | {:.1f} % | {}| {:.0e} | {:.1e} | {:.1e} | {} | {:.1f} | {:.1f} | {:.3f} | "
                "{:.3f} |\n",
                place.name, duration, share(s.closed, count), share(s.fading, count), paces, s.gapMax,
                mean / place.size, most / place.size, s.vertices / count,
                static_cast<double>(s.bytes) / static_cast<double>(count) / 1000, found, firstTime, lastTime);
            const std::string where = fmt::format("{}, {} s", place.name, duration);
            if (!(s.paceMin >= 2.0 / 3) || !(s.paceMax <= 4.0 / 3))
                broken.push_back(fmt::format("{}: paces from {} to {}", where, s.paceMin, s.paceMax));
            if (s.outside + first.outside + last.outside > 0) broken.push_back(where + ": points are outside");
            if (!same(loops->at(duration).points, loops->at(0).points))
                broken.push_back(where + ": the loop does not close");
        }
    }
    return broken;
}

} // namespace curlew::paper
