// SPDX-License-Identifier: Apache-2.0
#include "curlew/picture/Warp.h"

#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/picture/ColorMap.h"
#include "curlew/picture/Display.h"
#include "curlew/track/Advect.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace curlew {

namespace {

using Position = Vec<double, 2>;

/// Below this residual of f, relative to its root mean square, corrections only shift rounding errors.
constexpr double kRounding = 1e-14;

bool isFinite(const Position& p) { return std::isfinite(p[0]) && std::isfinite(p[1]); }

/// Moves points by equal steps.
void moveBatch(const FlowN<2>& flow, const ReprojectOptionsN<2>& reprojection, const WarpOptions& o,
               PointBatchN<2>& points) {
    std::array<double, kBatch> dt, unlimited;
    dt.fill(o.time / o.steps);
    unlimited.fill(std::numeric_limits<double>::infinity());
    const auto velocity = [&](const PointBatchN<2>& p, VecBatchN<double, 2>& v) { flow.velocity(p, v); };
    TrackBatchN<2> track{};
    FlowN<2>::Jets<double> potentials;
    StagesN<2> stages;
    flow.eval(points, potentials, stages[0]);
    track[0] = potentials[0].c[0];
    ReprojectedBatchN<2> landed;
    for (int k = 0; k < o.steps; ++k) {
        PointBatchN<2> next;
        step(o.scheme.value_or(Scheme::rk4), points, dt, velocity, stages, next);
        reproject(flow, next, track, unlimited, reprojection, landed);
        points = next;
        stages[0] = landed.velocity;
    }
}

/// Moves positions by adaptive steps. Drops the wall, so that positions cross it as with equal steps, which suits a
/// picture.
void moveAdaptively(const FlowN<2>& flow, std::vector<Position>& positions, const WarpOptions& o,
                    const Monitor& monitor) {
    const ReprojectionOptions reprojection{.method = o.corrections > 0 ? Reprojection::newton : Reprojection::none,
                                           .tolerance = kRounding,
                                           .iterations = std::max(o.corrections, 1),
                                           .maxSubdivisions = 0};
    advect(flow.within({.box = flow.domain().box, .wall = {}}), positions,
           {.time = o.time, .scheme = o.scheme, .reprojection = reprojection, .accuracy = o.accuracy}, monitor);
}

} // namespace

void WarpOptions::validate(const FlowN<2>& flow) const {
    if (steps < 0) throw ValueError(fmt::format("{} steps; give at least 1, or 0 to have the number chosen", steps));
    if (!std::isfinite(time)) throw ValueError("time must be finite");
    if (corrections < 0) throw ValueError(fmt::format("{} corrections; give 0 or more", corrections));
    if (corrections > 0 && !flow.hasTracks())
        throw ValueError("this flow has no tracks to correct positions onto; use 0 corrections");
}

void warp(const FlowN<2>& flow, std::vector<Position>& positions, const WarpOptions& options, const Monitor& monitor) {
    options.validate(flow);
    if (options.adaptive()) return moveAdaptively(flow, positions, options, monitor);
    ReprojectOptionsN<2> reprojection{.method = options.corrections > 0 ? Reprojection::newton : Reprojection::none,
                                      .iterations = options.corrections};
    reprojection.tolerance[0] = kRounding * rmsOf(flow).potentials[0];
    forEachBatch(
        positions,
        [&](PointBatchN<2>& points, size_t begin) {
            moveBatch(flow, reprojection, options, points);
            storeBatch(points, positions, begin);
        },
        monitor);
}

Vec3f wavePattern(const Position& position) {
    if (!isFinite(position)) return kNoValueColor;
    const double y = position[1] + 0.05 * std::abs(std::cos(10 * std::numbers::pi * (position[0] - position[1])));
    const double s = y + 1213.12;
    const int stripe = static_cast<int>(std::floor(10 * (s - std::floor(s))));
    return colorAt(ColorMap::viridis, static_cast<float>(17 * stripe % 13) / 13);
}

Texture2 textureOf(const Image& picture, const BoxN<2>& box) {
    if (!(box.size()[0] > 0) || !(box.size()[1] > 0) || !box.finite())
        throw ValueError("a texture needs a box that is neither empty nor infinite");
    return [image = displayed(picture), box](const Position& p) {
        if (!isFinite(p)) return kNoValueColor;
        // In pixels from the centre of the first one.
        const auto place = [](double part, int pixels) { return std::clamp(part * pixels - 0.5, 0.0, pixels - 1.0); };
        const double x = place((p[0] - box.lower[0]) / box.size()[0], image.width);
        const double y = place((box.upper[1] - p[1]) / box.size()[1], image.height);
        const int left = std::min(static_cast<int>(x), std::max(image.width - 2, 0));
        const int top = std::min(static_cast<int>(y), std::max(image.height - 2, 0));
        const int right = std::min(left + 1, image.width - 1), bottom = std::min(top + 1, image.height - 1);
        const double u = x - left, v = y - top;
        Vec3f color;
        for (int c = 0; c < 3; ++c) {
            const auto at = [&](int i, int j) { return static_cast<double>(image.at(i, j, c)); };
            color[c] = static_cast<float>(std::lerp(std::lerp(at(left, top), at(right, top), u),
                                                    std::lerp(at(left, bottom), at(right, bottom), u), v));
        }
        return color;
    };
}

Image warpedPicture(const FlowN<2>& flow, const Texture2& texture, const BoxN<2>& box, int width, int height,
                    const WarpOptions& options, const Monitor& monitor, const Warper& warper) {
    if (!(box.size()[0] > 0) || !(box.size()[1] > 0) || !box.finite())
        throw ValueError("a picture of a warp needs a box that is neither empty nor infinite");
    const int n = options.supersampling;
    if (n < 1 || n > 16) throw ValueError(fmt::format("supersampling {} must be 1 to 16", n));
    requireMemory(static_cast<double>(width) * height * (n * n + 1) * sizeof(Position),
                  fmt::format("a picture of {} x {} pixels", width, height), "make it smaller");
    Image picture = filledImage(width, height, {"R", "G", "B"});
    const auto samples = static_cast<size_t>(n) * static_cast<size_t>(n);
    std::vector<Position> positions;
    positions.reserve(picture.pixels.size() / 3 * samples);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int i = 0; i < n; ++i)
                for (int j = 0; j < n; ++j)
                    positions.push_back({{box.lower[0] + (x + (j + 0.5) / n) / width * box.size()[0],
                                          box.upper[1] - (y + (i + 0.5) / n) / height * box.size()[1]}});
    warper(flow, positions, options, monitor);
    parallelFor(positions.size() / samples, 1 << 12, [&](size_t begin, size_t end) {
        for (size_t k = begin; k < end; ++k) {
            Vec3f sum;
            for (size_t sample = 0; sample < samples; ++sample) sum += texture(positions[k * samples + sample]);
            sum *= 1 / static_cast<float>(samples);
            std::copy(sum.c.begin(), sum.c.end(), &picture.pixels[3 * k]);
        }
    });
    return picture;
}

namespace {

struct DifferenceSum {
    double squares = 0, largest = 0;
    size_t values = 0, unmatched = 0;
    DifferenceSum& operator+=(const DifferenceSum& o) {
        squares += o.squares;
        largest = std::max(largest, o.largest);
        values += o.values;
        unmatched += o.unmatched;
        return *this;
    }
};

DifferenceSum differenceOf(float a, float b) {
    if (std::isnan(a) || std::isnan(b)) return {.unmatched = std::isnan(a) == std::isnan(b) ? 0u : 1u};
    const double d = a == b ? 0 : std::abs(static_cast<double>(a) - static_cast<double>(b)); // also equal infinities
    return {.squares = d * d, .largest = d, .values = 1};
}

} // namespace

ImageDifference differenceOf(const Image& a, const Image& b) {
    checkImage(a);
    checkImage(b);
    if (a.width != b.width || a.height != b.height || a.channels.size() != b.channels.size())
        throw ValueError(fmt::format("images of {} x {} pixels ({}) and {} x {} ({}) cannot be compared", a.width,
                                     a.height, fmt::join(a.channels, " "), b.width, b.height,
                                     fmt::join(b.channels, " ")));
    const DifferenceSum sum = parallelSum(a.pixels.size(), 1 << 16, [&](size_t begin, size_t end) {
        DifferenceSum part;
        for (size_t k = begin; k < end; ++k) part += differenceOf(a.pixels[k], b.pixels[k]);
        return part;
    });
    return {.rms = std::sqrt(sum.squares / static_cast<double>(std::max<size_t>(sum.values, 1))),
            .largest = sum.largest,
            .unmatched = sum.unmatched};
}

} // namespace curlew
