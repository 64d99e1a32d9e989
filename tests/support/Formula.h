// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Algebra.h"
#include "curlew/field/Formula.h"
#include "curlew/field/NoiseField.h"
#include "curlew/field/Transforms.h"

namespace curlew::test {

template <int N = 3, class F>
ScalarFieldN<N> formula(F f) {
    return formulaField<N>(std::move(f));
}

/// Two analytic fields without symmetries, of wavelengths from 2 to 6, |value| <= 3.
inline ScalarField sinesF() {
    return formula([](const auto& x) { return sin(x[0] + x[1] * 2) + sin(x[1] - x[2] * 3) + cos(x[2] + x[0] * 2); });
}
inline ScalarField sinesG() {
    return formula([](const auto& x) { return cos(x[0] - x[2]) * sin(x[1] * 2 + x[0]) + sin(x[2] * 2 - x[1]) * 2; });
}

/// Eight waves in N dimensions, C^inf, within ±1: wave vectors are at most 2 pi 1.25 / 4 < 2 long, so the n-th
/// derivative along any unit vectors is at most 2^n.
template <int N>
ScalarFieldN<N> waves(uint64_t seed) {
    return noiseField<SineNoise<N>>({.seed = seed}, {.frequency = 0.25});
}

inline Placement moved(const Vec3d& offset) { return {.offset = offset}; }

} // namespace curlew::test
