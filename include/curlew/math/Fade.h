// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Jet.h"

namespace curlew {

/// The quintic smoothstep 6s^5 - 15s^4 + 10s^3 of s clamped to [0, 1] (Perlin 2002). It is C²: its first and second
/// derivatives are 0 at both ends.
template <class T>
constexpr Univariate<T> quinticFade(T s) {
    s = min(T(1), max(T(0), s)); // a NaN stays NaN
    const T r = s - T(1);
    return {s * s * s * mulAdd(s, mulAdd(s, T(6), T(-15)), T(10)), T(30) * s * s * r * r,
            T(60) * s * r * mulAdd(T(2), s, T(-1)),
            select((s <= T(0)) | (s >= T(1)), T(0), T(60) * mulAdd(T(6) * s, r, T(1)))};
}

} // namespace curlew
