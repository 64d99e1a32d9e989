// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/MinimumNorm.h"
#include "curlew/track/Stepper.h"

namespace curlew {

// What a step does at one position, for numbers T: double, lanes of double, or symbols.

/// Returns Σ weights_k stage(k). Stages of weight 0 are not read.
template <class T, int N, class Stage>
Vec<T, N> weightedSum(const std::array<double, Tableau::kMaxStages>& weights, const Stage& stage) {
    size_t first = 0;
    while (weights[first] == 0 && first + 1 < weights.size()) ++first;
    Vec<T, N> total = stage(first) * T(weights[first]);
    for (size_t k = first + 1; k < weights.size(); ++k) {
        if (weights[k] == 0) continue;
        const Vec<T, N> part = stage(k);
        for (int axis = 0; axis < N; ++axis) total[axis] = mulAdd(part[axis], T(weights[k]), total[axis]);
    }
    return total;
}

/// Returns p + move, with the move clamped to the limit's length.
template <class T, int N>
Vec<T, N> movedWithin(const T& limit, const Vec<T, N>& p, const Vec<T, N>& move) {
    const T size = length(move), scale = select(size > limit, limit / size, T(1));
    Vec<T, N> moved;
    for (int k = 0; k < N; ++k) moved[k] = mulAdd(move[k], scale, p[k]);
    return moved;
}

/// Takes a Gauss-Newton step for all potentials at once: moves p by the smallest v with J v = r, but not farther than
/// the limit. `r` are the track's values minus the potentials. The potentials with the largest residuals, relative to
/// their tolerance, come first: they take precedence where gradients are nearly parallel (see minimumNorm).
template <class T, int N, size_t M>
Vec<T, N> gaussNewtonMoved(const Vec<T, N>& p, std::array<Vec<T, N>, M> J, std::array<T, M> r,
                           const std::array<double, M>& tolerance, const T& limit) {
    std::array<T, M> off;
    for (size_t k = 0; k < M; ++k) off[k] = abs(r[k]) / T(tolerance[k]);
    const auto order = [&](size_t k) {
        const auto wrong = off[k] < off[k + 1];
        const auto swapWhere = [&](T& a, T& b) {
            const T kept = a;
            a = select(wrong, b, a);
            b = select(wrong, kept, b);
        };
        for (int axis = 0; axis < N; ++axis) swapWhere(J[k][axis], J[k + 1][axis]);
        swapWhere(r[k], r[k + 1]);
        swapWhere(off[k], off[k + 1]);
    };
    for (size_t end = M - 1; end > 0; --end)
        for (size_t k = 0; k < end; ++k) order(k);
    return movedWithin(limit, p, minimumNorm(J, r));
}

} // namespace curlew
