// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Random.h"
#include "curlew/field/Bound.h"

namespace curlew {

/// Calls use(points) with batches of 1024 positions in and around the shape of a wall, or in `box` if it is unbounded.
template <class Use>
void visitAround(const Wall& wall, const Box& box, const Use& use) {
    constexpr uint64_t kSamples = 1024;
    const Box around = wall.sdf.bounds.finite() ? wall.sdf.bounds.padded(wall.width) : box;
    for (uint64_t k = 0; k < kSamples;) {
        PointBatch points;
        for (; !points.full(); ++k) {
            Vec3d p = around.lower;
            for (int axis = 0; axis < 3; ++axis)
                p[axis] += around.size()[axis] * randomUniform(0, k, static_cast<uint64_t>(axis));
            points.push(p);
        }
        use(points);
    }
}

} // namespace curlew
