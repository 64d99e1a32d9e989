// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Evaluate.h"
#include "curlew/flow/Flow.h"

namespace curlew {

/// velocities[k] = flow(positions[k]) in world units per second; velocities are Vec<float, N> or Vec<double, N>. Like
/// evaluateValues(), which evaluates potentials: evaluateValues(flow.potentials()[q], …).
template <int N, std::ranges::contiguous_range Velocities>
void evaluateVelocities(const FlowN<N>& flow, Positions<N> positions, Velocities&& velocities,
                        const Monitor& monitor = {}) {
    using T = std::remove_cvref_t<decltype(std::ranges::begin(velocities)->c[0])>;
    detail::requireSameSize(std::ranges::size(velocities), positions.size());
    forEachBatch(
        positions,
        [&](const PointBatchN<N>& points, size_t begin) {
            VecBatchN<T, N> velocity;
            flow.velocity(points, velocity);
            for (int i = 0; i < points.size; ++i)
                std::ranges::data(velocities)[begin + static_cast<size_t>(i)] = velocity[i];
        },
        monitor);
}

} // namespace curlew
