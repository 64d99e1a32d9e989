#pragma once

#include "curlew/math/Vec.h"

namespace curlew {

/// The smallest v with J v = r, J given by its M <= N rows: v = Jᵀ (J Jᵀ)⁻¹ r (ICN Eq. 10 and 11), by orthogonalising
/// the rows one after the other (Gram and Schmidt), which does not square the condition number as J Jᵀ would.
///
/// A row that depends on those before it, to within `parallel` (the sine of the angle between them, squared), or that
/// is zero, is left out: where the equations contradict each other, the first ones win.
template <int N, size_t M>
constexpr Vec<double, N> minimumNorm(const std::array<Vec<double, N>, M>& J, const std::array<double, M>& r,
                                     double parallel = 1e-12) {
    std::array<Vec<double, N>, M> q{};    // orthogonal, not normalised
    std::array<double, M> squared{}, y{}; // |q|², and v = Σ y q
    Vec<double, N> v;
    for (size_t i = 0; i < M; ++i) {
        Vec<double, N> rest = J[i];
        double target = r[i];
        for (size_t j = 0; j < i; ++j) {
            if (!(squared[j] > 0)) continue;
            const double along = dot(rest, q[j]) / squared[j];
            rest -= q[j] * along;
            target -= along * squared[j] * y[j];
        }
        const double size = dot(rest, rest);
        if (!(size > parallel * dot(J[i], J[i]))) continue;
        q[i] = rest;
        squared[i] = size;
        y[i] = target / size;
        v += rest * y[i];
    }
    return v;
}

} // namespace curlew
