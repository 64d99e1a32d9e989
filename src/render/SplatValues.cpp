// SPDX-License-Identifier: Apache-2.0
#include "curlew/render/SplatValues.h"

#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/base/Random.h"
#include "curlew/math/Percentile.h"
#include "curlew/render/Splat.h"

#include <cmath>

namespace curlew {

namespace {

template <class Value>
std::vector<float> forEach(size_t count, const Value& value) {
    std::vector<float> values(count);
    parallelFor(count, 1 << 16, [&](size_t begin, size_t end) {
        for (size_t k = begin; k < end; ++k) values[k] = static_cast<float>(value(k));
    });
    return values;
}

/// How far each position is from the eye along a unit vector.
template <class Positions>
std::vector<float> fromEye(const Positions& p, const Vec3d& eye, const Vec3d& axis) {
    return forEach(p.x.size(), [&](size_t k) { return dot(axis, Vec3d{{p.x[k], p.y[k], p.z[k]}} - eye); });
}

double placeAmong(size_t k, size_t count) {
    return count > 1 ? static_cast<double>(k) / static_cast<double>(count - 1) : 0.5;
}

double randomOf(int64_t id) { return randomUniform(0, static_cast<uint64_t>(id)); }

} // namespace

std::vector<float> splatValues(const Points& p, SplatValue by, const Camera& camera) {
    switch (by) {
        case SplatValue::speed:
            if (!p.hasVelocity()) throw ValueError("these points have no velocity yet; -advect gives them one");
            return forEach(p.size(), [&](size_t k) { return length(Vec3f{{p.vx[k], p.vy[k], p.vz[k]}}); });
        case SplatValue::height:
            return fromEye(p, camera.eye(), camera.up());
        case SplatValue::depth:
            return fromEye(p, camera.eye(), camera.forward());
        case SplatValue::id:
            return forEach(p.size(), [&](size_t k) { return randomOf(p.id[k]); });
        case SplatValue::age:
            if (!p.hasAge()) throw ValueError("these points have no age; -emit gives them one");
            return p.age;
        case SplatValue::index:
            break;
    }
    return forEach(p.size(), [&](size_t k) { return placeAmong(k, p.size()); });
}

std::vector<float> splatValues(const Curves& c, SplatValue by, const Camera& camera) {
    if (by == SplatValue::speed) return forEach(c.vertices(), [&](size_t v) { return c.speed(v); });
    if (by == SplatValue::height) return fromEye(c, camera.eye(), camera.up());
    if (by == SplatValue::depth) return fromEye(c, camera.eye(), camera.forward());
    if (by == SplatValue::age) return forEach(c.vertices(), [&](size_t v) { return c.along[v]; });
    std::vector<float> values;
    for (size_t k = 0; k < c.size(); ++k)
        values.insert(values.end(), c.start[k + 1] - c.start[k],
                      static_cast<float>(by == SplatValue::id ? randomOf(c.id[k]) : placeAmong(k, c.size())));
    return values;
}

Interval splatRange(const std::vector<float>& values, SplatValue by) {
    if (by == SplatValue::id || by == SplatValue::index) return {0, 1};
    std::vector<float> some;
    forEnough(values.size(), [&](size_t k) {
        if (std::isfinite(values[k])) some.push_back(values[k]);
    });
    if (some.empty()) return {0, 1};
    constexpr double kRounding = 1e-6; // of floats
    const Interval range = percentiles(std::move(some), 0.02, 0.98);
    const bool constant = range.upper - range.lower <= kRounding * range.maxAbs();
    return constant ? Interval{range.lower - 0.5, range.lower + 0.5} : range;
}

} // namespace curlew
