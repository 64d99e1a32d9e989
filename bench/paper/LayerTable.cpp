// SPDX-License-Identifier: Apache-2.0
#include "Tables.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flow.h"
#include "curlew/flow/Flows.h"
#include "curlew/track/Advect.h"
#include "curlew/track/Scatter.h"
#include "curlew/vdb/LevelSet.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <functional>
#include <span>

namespace curlew::paper {

namespace {

constexpr size_t kBins = 5;                                   ///< Bins of equal depth in a layer.
constexpr size_t kPositions = 4000;                           ///< Positions for each noise.
constexpr int kDim = 128, kFewerDim = 64;                     ///< Voxels along the mesh's longest edge.
constexpr std::array<double, 4> kWidths{0.2, 0.3, 0.45, 0.6}; ///< Layer widths times the frequency.
constexpr std::array<double, 3> kFrequencies{2, 3, 5};
constexpr std::array<double, 4> kMax{1.45, 1.3, 1.3, 1.3}, kMin{0.6, 0.75, 0.6, 0.6}; ///< The claimed bounds.

/// An object, and one side of it.
struct Place {
    std::string name;
    Side side;
    std::function<Sdf(double distance)> sdf; ///< Signed distance that is valid up to a distance.
};

std::vector<Place> places(const TableRun& run) {
    const auto mesh = std::make_shared<const Mesh>(readMesh(CURLEW_SCENES "/spot.obj"));
    const LevelSet spot = meshToLevelSet(mesh, {.dim = run.scale < 1 ? kFewerDim : kDim});
    const auto sphere = [](double) { return sphereSdf(1); };
    const auto cow = [spot](double distance) {
        return sdfOf(widened(spot, distance / spot.voxelSize() + kSplineSupport));
    };
    return {{"sphere", Side::inside, sphere},
            {"sphere", Side::outside, sphere},
            {"spot", Side::inside, cow},
            {"spot", Side::outside, cow}};
}

/// How a noise is made to conform to a wall.
using Bind = std::function<ScalarField(const ScalarField& noise, const Wall& wall)>;

ScalarField asNow(const ScalarField& noise, const Wall& wall) { return bounded(noise, wall); }

/// Scales the noise to a slope of 1, which all versions but the first use.
ScalarField scaled(const ScalarField& noise, const Wall& wall) {
    return (1 / noiseScaleOf(noise, wall.sdf.bounds).slope) * noise;
}

ScalarField asPrinted(const ScalarField& noise, const Wall& wall) {
    const ScalarField alpha = layerFade(wall), one = constantField(1);
    return (one - alpha) * wall.sdf.distance + alpha * scaled(noise, wall);
}

/// The former default: a noise with the layer's width as its amplitude, shifted by more than that.
ScalarField separated(const ScalarField& noise, const Wall& wall) {
    const double sign = wall.side == Side::inside ? -1 : 1;
    const ScalarField alpha = layerFade(wall), one = constantField(1);
    const ScalarField shifted =
        (wall.width / noise.range().maxAbs()) * noise + constantField(sign * 1.125 * wall.width);
    return (one - alpha) * wall.sdf.distance + alpha * shifted;
}

/// Sums for the mean square speeds by depth.
struct Profile {
    std::array<double, kBins> sum{}, count{};
    double beyond = 0, deep = 0;
    Profile& operator+=(const Profile& o) {
        for (size_t k = 0; k < kBins; ++k) sum[k] += o.sum[k], count[k] += o.count[k];
        beyond += o.beyond, deep += o.deep;
        return *this;
    }
    double at(size_t bin) const { return std::sqrt(sum[bin] / count[bin] * deep / beyond); }
};

/// Positions on the flow's side of the wall, with their depths.
struct Samples {
    std::vector<Vec3d> positions;
    std::vector<double> depths;

    Samples(const Wall& wall, size_t count) {
        const Points points = scatter(Domain::of(wall, wall.width * 2), count, 1);
        for (size_t k = 0; k < points.size(); ++k) positions.push_back(points.position(k));
        depths.resize(positions.size());
        forEachBatch(positions, [&](const PointBatch& batch, size_t begin) {
            JetBatch<double, 0> d;
            wall.sdf.distance.eval(batch, d);
            for (int i = 0; i < batch.size; ++i) depths[begin + static_cast<size_t>(i)] = std::abs(d[i].value);
        });
    }
};

/// Returns the profile of a flow in its layer. The speed beyond the layer is that of the same flow without a wall, at
/// all positions.
Profile profileOf(const Flow& flow, const Flow& open, const Samples& samples, double width) {
    return sumOverBatches(samples.positions, [&](const PointBatch& batch, size_t begin) {
        VecBatch<double> c, free;
        flow.velocity(batch, c);
        open.velocity(batch, free);
        Profile profile;
        for (int i = 0; i < batch.size; ++i) {
            const double s = samples.depths[begin + static_cast<size_t>(i)] / width;
            profile.beyond += dot(free[i], free[i]);
            profile.deep += 1;
            if (s >= 1) continue;
            const auto bin = static_cast<size_t>(s * kBins);
            profile.sum[bin] += dot(c[i], c[i]);
            profile.count[bin] += 1;
        }
        return profile;
    });
}

struct Noises {
    ScalarField f, g;
};

Noises noises(double frequency, int octaves, uint64_t pair) {
    const OctaveOptions options{.frequency = frequency, .octaves = octaves};
    return {noiseField<Psrd3>({.seed = 2 * pair + 1}, options), noiseField<Psrd3>({.seed = 2 * pair + 2}, options)};
}

/// Returns the profile over several pairs of noises.
Profile profile(const Bind& bind, const Wall& wall, const Samples& samples, double frequency, int octaves, int pairs,
                bool sameSlope) {
    Profile sum;
    for (int pair = 0; pair < pairs; ++pair) {
        const Noises n = noises(frequency, octaves, static_cast<uint64_t>(pair));
        const double factor =
            sameSlope ? 1 / noiseScaleOf(n.g, wall.sdf.bounds).slope : wall.width / n.g.range().maxAbs();
        sum += profileOf(Flow(n.f, bind(n.g, wall)), Flow(n.f, factor * n.g), samples, wall.width);
    }
    return sum;
}

/// The extremes over all bins.
struct Extremes {
    double least = 1e300, most = 0;
    void see(double value) { least = std::min(least, value), most = std::max(most, value); }
    void see(const Profile& profile) {
        for (size_t k = 0; k < kBins; ++k) see(profile.at(k));
    }
};

void profiles(const TableRun& run, fmt::memory_buffer& text, std::vector<std::string>& broken) {
    const auto out = std::back_inserter(text);
    const int pairs = std::max(3, static_cast<int>(std::lround(16 * run.scale))); // two give too much scatter
    const auto frequencies = std::span(kFrequencies).first(run.scale < 1 ? 1 : kFrequencies.size());
    fmt::format_to(
        out,
        "Rms speeds in the layer at a wall, in {} bins from the wall to the end of the layer, relative to "
        "the rms speed of the same noises without a wall. Means over the frequencies {}, with 1 and 2 "
        "octaves, {} pairs of noises for each, and {} positions. Min and max are over the bins of all of these "
        "noises. As printed: Eq. 13 with (1 − α) d and the same noises. Before: the former default, in "
        "which the noise was scaled to the width of the layer and shifted by more than its bound.\n\n"
        "| object | side | width × frequency | wall | | | | end | min | max | as printed | before |\n"
        "|---|---|---|---|---|---|---|---|---|---|---|---|\n",
        kBins, fmt::join(frequencies, ", "), pairs, kPositions);
    for (const Place& place : places(run))
        for (size_t w = 0; w < kWidths.size(); ++w) {
            std::array<double, kBins> mean{};
            Extremes now, printed, before;
            for (const double frequency : frequencies) {
                const double width = kWidths[w] / frequency;
                const Wall wall{.sdf = place.sdf(width), .side = place.side, .width = width};
                const Samples samples(wall, kPositions);
                for (const int octaves : {1, 2}) {
                    const Profile found = profile(asNow, wall, samples, frequency, octaves, pairs, true);
                    for (size_t k = 0; k < kBins; ++k)
                        mean[k] += found.at(k) / (2.0 * static_cast<double>(frequencies.size()));
                    now.see(found);
                    printed.see(profile(asPrinted, wall, samples, frequency, octaves, pairs, true));
                    before.see(profile(separated, wall, samples, frequency, octaves, pairs, false));
                }
            }
            fmt::format_to(out, "| {} | {} | {} ", place.name, place.side == Side::inside ? "inside" : "outside",
                           kWidths[w]);
            for (const double speed : mean) fmt::format_to(out, "| {:.2f} ", speed);
            fmt::format_to(out, "| {:.2f} | {:.2f} | {:.2f} … {:.2f} | {:.2f} … {:.2f} |\n", now.least, now.most,
                           printed.least, printed.most, before.least, before.most);
            const double slack = run.scale < 1 ? 0.1 : 0; // fewer noises give more scatter
            if (!(now.least >= kMin[w] - slack && now.most <= kMax[w] + slack))
                broken.push_back(fmt::format("{}, width {}: {:.2f} … {:.2f}, not within {} … {}", place.name,
                                             kWidths[w], now.least, now.most, kMin[w], kMax[w]));
        }
}

void curlProfiles(const TableRun& run, fmt::memory_buffer& text) {
    const auto out = std::back_inserter(text);
    const int pairs = std::max(2, static_cast<int>(std::lround(16 * run.scale)));
    fmt::format_to(out,
                   "\nClassical curl noise with Bridson's ramp, inside the sphere, frequency 3:\n\n"
                   "| width × frequency | wall | | | | end |\n|---|---|---|---|---|---|\n");
    for (const double relative : kWidths) {
        const Wall wall{.sdf = sphereSdf(1), .width = relative / 3};
        const Samples samples(wall, kPositions);
        Profile all;
        for (int pair = 0; pair < pairs; ++pair) {
            const auto seed = static_cast<uint64_t>(pair);
            const std::array psi{noises(3, 1, seed).f, noises(3, 1, seed).g, noises(3, 1, seed + 1000).f};
            all += profileOf(curlFlow(psi, Domain::of(wall)), curlFlow(psi), samples, wall.width);
        }
        fmt::format_to(out, "| {} ", relative);
        for (size_t k = 0; k < kBins; ++k) fmt::format_to(out, "| {:.2f} ", all.at(k));
        fmt::format_to(out, "|\n");
    }
}

/// Advects points in the model spot, with large and small steps.
void advected(const TableRun& run, fmt::memory_buffer& text, std::vector<std::string>& broken) {
    const auto out = std::back_inserter(text);
    const auto count = static_cast<size_t>(200000 * run.scale);
    fmt::format_to(
        out,
        "\n{} points inside and outside spot, noises of frequency 3 with two octaves, a layer of width 0.1, rms speed "
        "1, time 2:\n\n| side | separated | scheme | steps | outside | not converged | processor seconds |\n"
        "|---|---|---|---|---|---|---|\n",
        count);
    const Noises n = noises(3, 2, 0);
    for (const Place& place : places(run)) {
        if (place.name != "spot") continue;
        const Wall wall{.sdf = place.sdf(0.1), .side = place.side, .width = 0.1};
        for (const bool separate : {false, true}) {
            const Flow flow = withSpeed(Flow(n.f, bounded(n.g, wall, {.separate = separate}), Domain::of(wall)), 1);
            for (const auto& [scheme, steps] : {std::pair{Scheme::rk4, 100}, {Scheme::rk4, 10}, {Scheme::euler, 10}}) {
                Points points = scatter(flow.domain(), count, 7);
                const std::clock_t begin = std::clock();
                const AdvectResult result = advect(flow, points, {.time = 2, .steps = steps, .scheme = scheme});
                const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
                const double part = static_cast<double>(result.notConverged) / static_cast<double>(count);
                fmt::format_to(out, "| {} | {} | {} | {} | {} | {:.1e} | {:.2f} |\n",
                               place.side == Side::inside ? "inside" : "outside", separate ? "yes" : "no",
                               scheme == Scheme::rk4 ? "RK4" : "Euler", steps, result.outside, part, seconds);
                if (!separate && (result.outside > 0 || !(part <= 1e-4)))
                    broken.push_back(fmt::format("{} steps: {} points outside, {} not converged", steps, result.outside,
                                                 result.notConverged));
            }
        }
    }
}

} // namespace

std::vector<std::string> layerTable(const TableRun& run, std::ostream& out) {
    fmt::memory_buffer text;
    std::vector<std::string> broken;
    fmt::format_to(std::back_inserter(text), "## ICN Eq. 13: the speed of the flow in the layer at a wall\n\n");
    profiles(run, text, broken);
    curlProfiles(run, text);
    advected(run, text, broken);
    out << std::string_view(text.data(), text.size());
    return broken;
}

} // namespace curlew::paper
