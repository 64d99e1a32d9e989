// SPDX-License-Identifier: Apache-2.0
#include "curlew/picture/Slice.h"

#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace curlew {

namespace {

constexpr float kEmpty = std::numeric_limits<float>::quiet_NaN();
constexpr int kMaxSlicePixels = 1 << 15; // along an edge

/// One row of a slice: all samples of its pixels, and their means.
class SliceRow {
  public:
    SliceRow(const PicturePlane& plane, const SliceSource& source, int supersampling)
        : mPlane(plane),
          mSource(source),
          mN(supersampling),
          mValues(source.channels.size()),
          mSamples(source.channels.size() * static_cast<size_t>(plane.width() * supersampling * supersampling)) {}

    void sample(int row) {
        mDone = 0;
        for (int x = 0; x < mPlane.width(); ++x)
            for (int i = 0; i < mN; ++i)
                for (int j = 0; j < mN; ++j) {
                    mPoints.push(mPlane.at(x + (j + 0.5) / mN, row + (i + 0.5) / mN));
                    if (mPoints.full()) flush();
                }
        flush();
    }

    /// Returns the mean of a pixel's samples that are not NaN.
    float mean(int x, size_t channel) const {
        const size_t channels = mValues.size();
        const int samples = mN * mN;
        float sum = 0;
        int count = 0;
        for (int s = 0; s < samples; ++s)
            if (const float value = mSamples[static_cast<size_t>(x * samples + s) * channels + channel];
                !std::isnan(value)) {
                sum += value;
                ++count;
            }
        return 2 * count > samples ? sum / static_cast<float>(count) : kEmpty;
    }

  private:
    void flush() {
        if (mPoints.size == 0) return;
        mSource.eval(mPoints, mValues);
        const auto size = static_cast<size_t>(mPoints.size);
        for (size_t channel = 0; channel < mValues.size(); ++channel)
            for (size_t k = 0; k < size; ++k) mSamples[(mDone + k) * mValues.size() + channel] = mValues[channel][k];
        mDone += size;
        mPoints.size = 0;
    }

    const PicturePlane& mPlane;
    const SliceSource& mSource;
    int mN;
    SliceSource::Values mValues;
    std::vector<float> mSamples; ///< Channels interleaved.
    PointBatch mPoints;
    size_t mDone = 0;
};

/// Fills values by calling value(i) for each position i.
template <class Value>
void fill(int size, std::array<float, kBatch>& values, const Value& value) {
    for (int i = 0; i < size; ++i) values[static_cast<size_t>(i)] = value(i);
}

std::vector<std::string> components(std::string_view name) {
    return {fmt::format("{}.x", name), fmt::format("{}.y", name), fmt::format("{}.z", name)};
}

} // namespace

PicturePlane::PicturePlane(const Box& box, const SliceOptions& o)
    : mRight(o.axis == 0 ? 2 : 0), mUp(o.axis == 1 ? 2 : 1) {
    if (o.axis < 0 || o.axis > 2) throw ValueError(fmt::format("axis {} must be 0, 1 or 2", o.axis));
    if (!box.finite()) throw ValueError("the domain is infinite; give a box");
    if (o.width < 1 || o.width > kMaxSlicePixels)
        throw ValueError(fmt::format("width {} must be 1 to {} pixels", o.width, kMaxSlicePixels));
    if (!(o.margin >= 0) || !std::isfinite(o.margin)) throw ValueError("the margin must not be negative");
    const Vec3d size = box.size();
    if (!(size[mRight] > 0) || !(size[mUp] > 0)) throw ValueError("the box is empty");
    const double margin = o.margin * std::max(size[mRight], size[mUp]);
    const double width = size[mRight] + 2 * margin, height = size[mUp] + 2 * margin;
    const double rows = std::max(1.0, std::round(o.width * height / width));
    if (!(rows <= kMaxSlicePixels))
        throw ValueError(fmt::format("a height of {} pixels is too large; choose a smaller width", rows));
    mWidth = o.width;
    mHeight = static_cast<int>(rows);
    mPixel = width / o.width;
    mCorner[mRight] = box.lower[mRight] - margin;
    mCorner[mUp] = box.upper[mUp] + margin;
    mCorner[o.axis] = o.position;
}

Image slice(const Box& box, const SliceSource& source, const SliceOptions& o, const Monitor& monitor) {
    const PicturePlane plane(box, o);
    if (o.supersampling < 1 || o.supersampling > 16)
        throw ValueError(fmt::format("supersampling {} must be 1 to 16", o.supersampling));
    requireMemory(static_cast<double>(plane.width()) * plane.height() * static_cast<double>(source.channels.size()) *
                      sizeof(float),
                  fmt::format("a picture of {} x {} pixels", plane.width(), plane.height()), "choose a smaller width");
    Image image = filledImage(plane.width(), plane.height(), source.channels);
    parallelFor(
        static_cast<size_t>(image.height), 1,
        [&](size_t begin, size_t) {
            const int row = static_cast<int>(begin);
            SliceRow samples(plane, source, o.supersampling);
            samples.sample(row);
            for (int x = 0; x < image.width; ++x)
                for (size_t channel = 0; channel < source.channels.size(); ++channel)
                    image.at(x, row, static_cast<int>(channel)) = samples.mean(x, channel);
        },
        monitor);
    return image;
}

SliceSource flowSource(const Flow& flow, std::string_view name) {
    struct Seen {
        const PointBatch& points;
        const Flow::Jets<float>& potentials;
        const VecBatch<float>& velocity;
        const std::array<double, kBatch>& distance;
    };
    using Pick = void (*)(const Seen&, SliceSource::Values&);
    static constexpr auto kPotential = []<size_t K>(std::integral_constant<size_t, K>) {
        return [](const Seen& s, SliceSource::Values& v) { v[0] = s.potentials[K].c[0]; };
    };
    static constexpr auto kComponent = []<size_t K>(std::integral_constant<size_t, K>) {
        return [](const Seen& s, SliceSource::Values& v) { v[0] = s.velocity.c[K]; };
    };
    static constexpr std::array<std::pair<std::string_view, Pick>, 8> kPicks{{
        {"speed",
         [](const Seen& s, SliceSource::Values& v) {
             fill(s.points.size, v[0], [&](int i) { return length(s.velocity[i]); });
         }},
        {"vx", kComponent(std::integral_constant<size_t, 0>())},
        {"vy", kComponent(std::integral_constant<size_t, 1>())},
        {"vz", kComponent(std::integral_constant<size_t, 2>())},
        {"f", kPotential(std::integral_constant<size_t, 0>())},
        {"g", kPotential(std::integral_constant<size_t, 1>())},
        {"distance",
         [](const Seen& s, SliceSource::Values& v) {
             fill(s.points.size, v[0], [&](int i) { return static_cast<float>(s.distance[static_cast<size_t>(i)]); });
         }},
        {"velocity", [](const Seen& s, SliceSource::Values& v) { std::copy_n(s.velocity.c.begin(), 3, v.begin()); }},
    }};
    const auto* found =
        std::find_if(kPicks.begin(), kPicks.end(), [&](const auto& pick) { return pick.first == name; });
    if (found == kPicks.end())
        throw ValueError(
            fmt::format("a flow has no channel '{}'; choose speed, vx, vy, vz, f, g, distance or velocity", name));
    const auto eval = [flow, pick = found->second](const PointBatch& points, SliceSource::Values& values) {
        std::array<bool, kBatch> allowed;
        std::array<double, kBatch> distance;
        classify(flow.domain(), points, allowed, distance);
        Flow::Jets<float> potentials;
        VecBatch<float> velocity;
        flow.eval(points, potentials, velocity);
        pick({points, potentials, velocity, distance}, values);
        for (int i = 0; i < points.size; ++i)
            if (!allowed[static_cast<size_t>(i)] || !flow.domain().box.contains(points[i]))
                for (auto& channel : values) channel[static_cast<size_t>(i)] = kEmpty;
    };
    return {.channels = name == "velocity" ? components(name) : std::vector{std::string(name)}, .eval = eval};
}

SliceSource fieldSource(const ScalarField& field, std::string_view name) {
    if (name == "value")
        return {.channels = {"value"}, .eval = [field](const PointBatch& points, SliceSource::Values& values) {
                    JetBatch<float, 0> jets;
                    field.eval(points, jets);
                    values[0] = jets.c[0];
                }};
    if (name != "gradient" && name != "slope")
        throw ValueError(fmt::format("a field has no channel '{}'; choose value, gradient or slope", name));
    const bool isVector = name == "gradient";
    return {.channels = isVector ? components(name) : std::vector{std::string(name)},
            .eval = [field, isVector](const PointBatch& points, SliceSource::Values& values) {
                JetBatch<float, 1> jets;
                field.eval(points, jets);
                if (isVector)
                    std::copy_n(jets.c.begin() + 1, 3, values.begin());
                else
                    fill(points.size, values[0], [&](int i) { return length(jets[i].gradient); });
            }};
}

SliceSource alongSource(const Flow& flow, const Vec3d& direction) {
    const double size = length(direction);
    if (!(size > 0)) throw ValueError("direction=0,0,0 is not a direction");
    Vec3f unit;
    for (int axis = 0; axis < 3; ++axis) unit[axis] = static_cast<float>(direction[axis] / size);
    return {
        .channels = {"along"},
        .eval = [velocity = flowSource(flow, "velocity"), unit](const PointBatch& points, SliceSource::Values& values) {
            SliceSource::Values v(3);
            velocity.eval(points, v);
            for (size_t i = 0; i < kBatch; ++i)
                values[0][i] = v[0][i] * unit[0] + v[1][i] * unit[1] + v[2][i] * unit[2];
        }};
}

SliceSource wallSource(const Domain& domain) {
    return {.channels = {"distance"}, .eval = [domain](const PointBatch& points, SliceSource::Values& values) {
                std::array<bool, kBatch> allowed;
                std::array<double, kBatch> found;
                classify(domain, points, allowed, found);
                for (size_t i = 0; i < kBatch; ++i) values[0][i] = static_cast<float>(found[i]);
            }};
}

Image inPlane(const Image& vectors, const PicturePlane& plane) {
    Image flat = filledImage(vectors.width, vectors.height, {"right", "up"});
    for (int y = 0; y < flat.height; ++y)
        for (int x = 0; x < flat.width; ++x) {
            flat.at(x, y, 0) = vectors.at(x, y, plane.right());
            flat.at(x, y, 1) = vectors.at(x, y, plane.up());
        }
    return flat;
}

} // namespace curlew
