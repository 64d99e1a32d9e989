// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"

namespace curlew {

/// The cross product of N - 1 vectors in N dimensions, cross(v1, …) · v = det[v | v1 | …] (ICN Eq. 1): orthogonal to
/// all of them, as long as the volume that they span. N = 2: (b, -a); N = 3: the usual one. T may be a jet.
///
/// The minors of the first k vectors come from those of the first k - 1, one for each set of k rows: N 2^(N-1) products
/// in all, no division, so it is as exact as its products.
template <class T, size_t M, int N = static_cast<int>(M) + 1>
constexpr Vec<T, N> cross(const std::array<Vec<T, N>, M>& v) {
    if constexpr (N == 2) return {{v[0][1], -v[0][0]}};
    if constexpr (N == 3) return cross(v[0], v[1]);
    constexpr unsigned kAll = (1u << N) - 1;
    std::array<T, kAll + 1> minors{}; // by the set of rows, as bits
    minors[0] = T(1);
    for (unsigned rows = 1; rows < kAll; ++rows) {
        const auto k = static_cast<unsigned>(__builtin_popcount(rows)) - 1; // the last column: v[k]
        bool negative = k % 2 == 1;                                         // the sign of its first row
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
