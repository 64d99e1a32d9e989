// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"

namespace curlew {

/// The cross product of N - 1 vectors in N dimensions: cross(v1, …) · v = det[v | v1 | …] (ICN Eq. 1). It is
/// orthogonal to all of them, and its length is the volume that they span. N = 2: (b, -a); N = 3: the usual cross
/// product. T may be a jet.
///
/// Computes the minors of the first k vectors from those of the first k - 1, one minor for each set of k rows. This
/// takes N 2^(N-1) products and no division, so the result is as accurate as its products.
template <class T, size_t M, int N = static_cast<int>(M) + 1>
constexpr Vec<T, N> cross(const std::array<Vec<T, N>, M>& v) {
    if constexpr (N == 2) return {{v[0][1], -v[0][0]}};
    if constexpr (N == 3) return cross(v[0], v[1]);
    constexpr unsigned kAll = (1u << N) - 1;
    std::array<T, kAll + 1> minors{}; // indexed by the set of rows, as a bit mask
    minors[0] = T(1);
    for (unsigned rows = 1; rows < kAll; ++rows) {
        const auto k = static_cast<unsigned>(__builtin_popcount(rows)) - 1; // index of the last column, v[k]
        bool negative = k % 2 == 1;                                         // sign of the expansion's first term
        T sum{};
        for (int i = 0; i < N; ++i) {
            if (!(rows >> i & 1u)) continue;
            const T product = v[k][i] * minors[rows ^ (1u << i)];
            if (negative)
                sum -= product;
            else
                sum += product;
            negative = !negative;
        }
        minors[rows] = sum;
    }
    Vec<T, N> c;
    for (int j = 0; j < N; ++j) {
        const T& minor = minors[kAll ^ (1u << j)];
        c[j] = j % 2 ? -minor : minor;
    }
    return c;
}

} // namespace curlew
