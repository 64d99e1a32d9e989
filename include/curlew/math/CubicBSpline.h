// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Arithmetic.h"

#include <array>

namespace curlew {

/// Returns the weights of the four coefficients around t in [0, 1) in the uniform cubic B-spline, or their derivatives
/// with respect to t, up to the third.
template <class T>
std::array<T, 4> cubicBSplineWeights(const T& t, int derivative) {
    const T s = T(1) - t;
    const auto sixth = static_cast<T>(1.0 / 6);
    switch (derivative) {
        case 0:
            return {s * s * s * sixth, mulAdd(t * t, mulAdd(T(3), t, T(-6)), T(4)) * sixth,
                    mulAdd(s * s, mulAdd(T(3), s, T(-6)), T(4)) * sixth, t * t * t * sixth};
        case 1:
            return {T(-0.5) * s * s, t * mulAdd(T(1.5), t, T(-2)), s * mulAdd(T(-1.5), s, T(2)), T(0.5) * t * t};
        case 2:
            return {s, mulAdd(T(3), t, T(-2)), mulAdd(T(-3), t, T(1)), t};
        default:
            return {T(-1), T(3), T(-3), T(1)};
    }
}

} // namespace curlew
