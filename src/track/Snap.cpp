// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/Snap.h"

#include "curlew/base/Require.h"
#include "curlew/field/ForEachBatch.h"

#include <array>
#include <cmath>
#include <optional>

namespace curlew {

namespace {

constexpr int kMaxSteps = 60;

/// Returns the position that each point reaches, or nullopt.
std::array<std::optional<Vec3d>, kBatch> snapped(const ScalarField& field, double value, const PointBatch& start,
                                                 double reach, double tolerance) {
    std::array<std::optional<Vec3d>, kBatch> found;
    PointBatch points = start;
    std::array<bool, kBatch> done{};
    for (int k = 0; k < kMaxSteps; ++k) {
        JetBatch<double, 1> jets;
        field.eval(points, jets);
        for (int i = 0; i < points.size; ++i) {
            const auto lane = static_cast<size_t>(i);
            if (done[lane]) continue;
            const auto jet = jets[i];
            const double off = value - jet.value;
            const Vec3d here = points[i], next = here + jet.gradient * (off / dot(jet.gradient, jet.gradient));
            const bool there = std::abs(off) <= tolerance;
            if (there) found[lane] = here;
            done[lane] = there || !(length(next - start[i]) <= reach); // NaN where the gradient is zero
            if (!done[lane]) points.set(i, next);
        }
    }
    return found;
}

struct SnapSums {
    size_t missed = 0;
    double moved = 0;
    SnapSums& operator+=(const SnapSums& other) {
        missed += other.missed;
        moved += other.moved;
        return *this;
    }
};

} // namespace

SnapResult snap(const ScalarField& field, double value, Points& p, double reach, double tolerance,
                const Monitor& monitor) {
    if (!std::isfinite(value)) throw ValueError(fmt::format("the value {} is not finite", value));
    requirePositive(reach, "the reach");
    requirePositive(tolerance, "the tolerance");
    const SnapSums sums = sumOverBatches(
        p,
        [&](const PointBatch& start, size_t begin) {
            const auto found = snapped(field, value, start, reach, tolerance);
            SnapSums mine;
            for (int i = 0; i < start.size; ++i) {
                const auto& to = found[static_cast<size_t>(i)];
                if (!to) {
                    ++mine.missed;
                    continue;
                }
                mine.moved += length(*to - start[i]);
                p.setPosition(begin + static_cast<size_t>(i), *to);
            }
            return mine;
        },
        monitor);
    for (auto* array : {&p.vx, &p.vy, &p.vz}) array->clear();
    for (auto* array : {&p.f, &p.g}) array->clear();
    p.converged.clear();
    const size_t there = p.size() - sums.missed;
    return {p.size(), sums.missed, there > 0 ? sums.moved / static_cast<double>(there) : 0};
}

} // namespace curlew
