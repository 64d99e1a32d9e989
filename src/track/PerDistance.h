// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"

namespace curlew {

/// Returns the shortest move that changes a distance by one, to first order, from the gradient of the distance:
/// ∇d / |∇d|². That is unbounded where gradients vanish, as midway between two parts of a wall. So below a length of a
/// half, the move goes to zero with the gradient; it is C¹, and 2.2 long at most.
inline Vec3d perDistance(const Vec3d& gradient) {
    constexpr double kShort = 0.25; // squared
    const double squared = dot(gradient, gradient);
    if (!(squared > 0)) return {};
    return gradient * (squared >= kShort ? 1 / squared : (2 - squared / kShort) / kShort);
}

} // namespace curlew
