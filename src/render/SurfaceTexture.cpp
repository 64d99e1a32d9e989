// SPDX-License-Identifier: Apache-2.0
#include "curlew/render/SurfaceTexture.h"

#include "curlew/base/Random.h"
#include "curlew/base/Require.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/picture/ColorMap.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace curlew {

namespace {

using std::numbers::pi;

/// White noise, constant per cube.
class SolidNoise {
  public:
    SolidNoise(double edge, uint64_t seed) : mPerUnit(1 / edge), mSeed(seed) {}
    double at(const Vec3d& p) const {
        const auto cell = [&](int axis) {
            return static_cast<uint64_t>(static_cast<int64_t>(std::floor(p[axis] * mPerUnit)));
        };
        return randomUniform(randomBits(mSeed, cell(0)), cell(1), cell(2));
    }

  private:
    double mPerUnit;
    uint64_t mSeed;
};

/// A colour at a value of a scale.
struct Stop {
    double at;
    Vec3f color;
};

/// Interpolates smoothly between the stops around a value; outside, returns the nearest stop.
template <size_t N>
Vec3f between(const std::array<Stop, N>& stops, double value) {
    const auto* upper = std::find_if(stops.begin() + 1, stops.end() - 1, [&](const Stop& s) { return value < s.at; });
    const Stop& lower = *(upper - 1);
    const auto part = static_cast<float>(std::clamp((value - lower.at) / (upper->at - lower.at), 0.0, 1.0));
    const float eased = part * part * (3 - 2 * part);
    return lower.color * (1 - eased) + upper->color * eased;
}

/// Moves points by a midpoint step along the flow's direction; they stay where the flow is zero.
void follow(const Flow& flow, PointBatch& points, double step) {
    VecBatch<float> velocity;
    const auto moved = [&](const PointBatch& from, double by) {
        PointBatch to = from;
        for (int i = 0; i < from.size; ++i) {
            Vec3d v;
            for (int axis = 0; axis < 3; ++axis) v[axis] = static_cast<double>(velocity[i][axis]);
            const double speed = length(v);
            if (speed > 0) to.set(i, from[i] + v * (by / speed));
        }
        return to;
    };
    flow.velocity(points, velocity);
    const PointBatch middle = moved(points, 0.5 * step);
    flow.velocity(middle, velocity);
    points = moved(points, step);
}

/// Averages the noise along the streamlines of a batch.
std::array<double, kBatch> convolved(const Flow& flow, const PointBatch& start, const SolidNoise& noise, double step,
                                     int steps) {
    std::array<double, kBatch> sum{};
    double weights = 0;
    const auto add = [&](const PointBatch& points, int k) {
        const double weight = 0.5 + 0.5 * std::cos(pi * k / (steps + 1));
        for (int i = 0; i < points.size; ++i) sum[static_cast<size_t>(i)] += weight * noise.at(points[i]);
        weights += weight;
    };
    add(start, 0);
    for (const double direction : {step, -step}) {
        PointBatch points = start;
        for (int k = 1; k <= steps; ++k) {
            follow(flow, points, direction);
            add(points, k);
        }
    }
    for (double& value : sum) value /= weights;
    return sum;
}

/// Returns the noise averaged along the streamlines through these positions.
template <class Positions>
std::vector<float> streaksAt(const Positions& positions, double resolution, const Flow& flow,
                             const SurfaceLicOptions& o, const Monitor& monitor) {
    requirePositive(o.length, "the streak length");
    requirePositive(o.grain, "the grain");
    requirePositive(o.contrast, "the contrast");
    const double grain = o.grain * 4 * resolution, step = 0.75 * grain;
    const int steps = std::max(1, static_cast<int>(std::lround(std::min(0.5 * o.length / (0.75 * o.grain), 1e4))));
    const SolidNoise noise(grain, o.seed);
    std::vector<float> values(positions.size());
    forEachBatch(
        positions,
        [&](const PointBatch& points, size_t begin) {
            const auto batch = convolved(flow, points, noise, step, steps);
            for (size_t i = 0; i < static_cast<size_t>(points.size); ++i)
                values[begin + i] = static_cast<float>(batch[i]);
        },
        monitor);
    return values;
}

LicRange rangeOf(const std::vector<float>& values) {
    double sum = 0, squares = 0;
    for (const float v : values) {
        sum += static_cast<double>(v);
        squares += static_cast<double>(v) * static_cast<double>(v);
    }
    const auto count = static_cast<double>(std::max<size_t>(values.size(), 1));
    const double mean = sum / count;
    return {.mean = mean, .deviation = std::sqrt(std::max(squares / count - mean * mean, 1e-12))};
}

} // namespace

std::vector<Vec3d> positionsOf(const SurfaceView& view) {
    std::vector<Vec3d> positions;
    positions.reserve(view.hits.size());
    for (const SurfaceSample& hit : view.hits) positions.push_back(hit.position);
    return positions;
}

Vec3f checkerAt(const Vec3d& position, double edge, const Vec3f& even, const Vec3f& odd) {
    int64_t sum = 0;
    for (const double x : position.c) sum += static_cast<int64_t>(std::floor(x / edge));
    return sum % 2 == 0 ? even : odd;
}

Vec3f latitudeAt(const Vec3d& position, const Vec3d& center) {
    static constexpr std::array<Stop, 17> kStops{{{-90, {{0.30f, 0.33f, 0.38f}}},
                                                  {-72, {{0.42f, 0.43f, 0.44f}}},
                                                  {-58, {{0.66f, 0.58f, 0.49f}}},
                                                  {-46, {{0.80f, 0.73f, 0.62f}}},
                                                  {-36, {{0.55f, 0.37f, 0.26f}}},
                                                  {-27, {{0.88f, 0.81f, 0.70f}}},
                                                  {-17, {{0.70f, 0.44f, 0.27f}}},
                                                  {-8, {{0.93f, 0.87f, 0.77f}}},
                                                  {0, {{0.95f, 0.91f, 0.84f}}},
                                                  {8, {{0.85f, 0.68f, 0.50f}}},
                                                  {17, {{0.62f, 0.34f, 0.21f}}},
                                                  {26, {{0.92f, 0.84f, 0.72f}}},
                                                  {36, {{0.66f, 0.49f, 0.36f}}},
                                                  {46, {{0.83f, 0.77f, 0.68f}}},
                                                  {58, {{0.57f, 0.53f, 0.49f}}},
                                                  {72, {{0.45f, 0.48f, 0.52f}}},
                                                  {90, {{0.33f, 0.38f, 0.45f}}}}};
    const Vec3d p = position - center;
    const double radius = length(p);
    const double latitude = radius > 0 ? std::asin(std::clamp(p[1] / radius, -1.0, 1.0)) * 180 / pi : 0;
    return between(kStops, latitude);
}

Vec3f terrainAt(double height) {
    static constexpr std::array<Stop, 5> kStops{{{0.0, {{0.004f, 0.098f, 0.133f}}},
                                                 {0.3, {{0.125f, 0.435f, 0.545f}}},
                                                 {0.5, {{0.475f, 0.624f, 0.231f}}},
                                                 {0.7, {{0.906f, 0.745f, 0.506f}}},
                                                 {1.0, {{1, 1, 1}}}}};
    return between(kStops, height);
}

Vec3f wavesAt(const Vec3d& position, double width) {
    if (!std::all_of(position.c.begin(), position.c.end(), [](double x) { return std::isfinite(x); }))
        return kNoValueColor;
    const double x = 1.2 * std::atan2(position[2], position[0]) / (2 * pi);
    const double y = (position[1] + length(Vec<double, 2>{{position[0], position[2]}})) / (10 * width);
    const double s = y + 0.05 * std::abs(std::cos(10 * pi * x)) + 1213.12;
    const int stripe = static_cast<int>(std::floor(10 * (s - std::floor(s))));
    return colorAt(ColorMap::viridis, static_cast<float>(17 * stripe % 13) / 13);
}

std::vector<float> surfaceLic(const SurfaceView& view, const Flow& flow, const SurfaceLicOptions& o,
                              const Monitor& monitor) {
    std::vector<float> values = streaksAt(PointsBy{view.hits.size(), [&](size_t k) { return view.hits[k].position; }},
                                          view.resolution, flow, o, monitor);
    const LicRange range = o.range ? *o.range : rangeOf(values);
    for (float& v : values)
        v = static_cast<float>(
            std::clamp(0.5 + (static_cast<double>(v) - range.mean) * o.contrast / range.deviation, 0.0, 1.0));
    return values;
}

LicRange surfaceLicRange(const std::vector<Vec3d>& positions, double resolution, const Flow& flow,
                         const SurfaceLicOptions& options, const Monitor& monitor) {
    return rangeOf(streaksAt(positions, resolution, flow, options, monitor));
}

} // namespace curlew
