// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"

namespace curlew {

/// Returns the v of minimum norm with J v = r, where J is given by its M <= N rows: v = Jᵀ (J Jᵀ)⁻¹ r (ICN Eq. 10 and
/// 11). Orthogonalises the rows one after another (Gram-Schmidt), which does not square the condition number as J Jᵀ
/// would. T is double or lanes of double.
///
/// Skips a row that is zero or linearly dependent on earlier rows, with a tolerance of `parallel` (squared sine of the
/// angle to their span). If equations contradict each other, the earlier ones win.
template <class T, int N, size_t M>
constexpr Vec<T, N> minimumNorm(const std::array<Vec<T, N>, M>& J, const std::array<T, M>& r, double parallel = 1e-12) {
    std::array<Vec<T, N>, M> q{};    // orthogonal, not normalised; zero for a skipped row
    std::array<T, M> squared{}, y{}; // |q|², or 1, and v = Σ y q
    Vec<T, N> v;
    for (size_t i = 0; i < M; ++i) {
        Vec<T, N> rest = J[i];
        T target = r[i];
        for (size_t j = 0; j < i; ++j) {
            const T along = dot(rest, q[j]) / squared[j];
            for (int k = 0; k < N; ++k) rest[k] = negMulAdd(q[j][k], along, rest[k]);
            target = negMulAdd(along * squared[j], y[j], target);
        }
        const T size = dot(rest, rest);
        const auto counts = size > T(parallel) * dot(J[i], J[i]);
        squared[i] = select(counts, size, T(1));
        y[i] = select(counts, target / squared[i], T(0));
        for (int k = 0; k < N; ++k) {
            q[i][k] = select(counts, rest[k], T(0));
            v[k] = mulAdd(q[i][k], y[i], v[k]);
        }
    }
    return v;
}

} // namespace curlew
