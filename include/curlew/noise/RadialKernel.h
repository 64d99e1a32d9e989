// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Jet.h"

namespace curlew {

/// Adds the contribution of one lattice vertex to a simplex noise: w^P (g · d) with w = max(radius2 - d · d, 0), where
/// d is the offset of the position from the vertex and g the gradient of the vertex. P, the power, is 3 or 4. The
/// contribution is C^(P-1).
template <class T, int N, int Order>
void addRadialKernel(Jet<T, N, Order>& sum, int power, T radius2, const Vec<T, N>& g, const Vec<T, N>& d) {
    T w = radius2;
    for (int i = 0; i < N; ++i) w = negMulAdd(d[i], d[i], w);
    w = max(w, T(0));
    const T ramp = dot(g, d);
    const T rest = power == 4 ? w : T(1);            // w^(P-3)
    const T w2 = rest * w, w1 = w2 * w, w0 = w1 * w; // w^(P-k)
    sum.value = mulAdd(w0, ramp, sum.value);
    const T slope = T(-2 * power) * w1, slopeRamp = slope * ramp;
    if constexpr (Order >= 1)
        for (int i = 0; i < N; ++i) sum.gradient[i] = mulAdd(d[i], slopeRamp, mulAdd(g[i], w0, sum.gradient[i]));
    if constexpr (Order >= 2) {
        const T bend = T(4 * power * (power - 1)) * w2 * ramp;
        Vec<T, N> sloped, bent;
        for (int i = 0; i < N; ++i) {
            sloped[i] = slope * d[i];
            bent[i] = mulAdd(bend, d[i], slope * g[i]);
        }
        for (int i = 0; i < N; ++i) {
            for (int j = i; j < N; ++j)
                sum.hessian(i, j) = mulAdd(bent[i], d[j], mulAdd(sloped[i], g[j], sum.hessian(i, j)));
            sum.hessian(i, i) += slopeRamp;
        }
    }
    if constexpr (Order >= 3) {
        const T w3 = select(w > T(0), rest, T(0)); // w^0 must be zero beyond the radius, too
        sum.forTriples([&](int i, int j, int k) {
            const auto overDeltas = [&](const Vec<T, N>& v) {
                return (j == k ? v[i] : T(0)) + (i == k ? v[j] : T(0)) + (i == j ? v[k] : T(0));
            };
            sum.third(i, j, k) +=
                T(4 * power * (power - 1)) * w2 *
                    (g[i] * d[j] * d[k] + g[j] * d[i] * d[k] + g[k] * d[i] * d[j] + ramp * overDeltas(d)) +
                slope * overDeltas(g) - T(8 * power * (power - 1) * (power - 2)) * w3 * ramp * d[i] * d[j] * d[k];
        });
    }
}

} // namespace curlew
