// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace curlew {

/// A lattice vertex of SimplexNoise that comes within √(3/4) of some point of a simplex. From the simplex's lowest
/// corner the others follow by steps along the axes, in the order of the point's skewed coordinates, the largest first;
/// one more step, by -1 along all axes, would lead back. A near vertex is a corner, or one such step from it.
///
/// With r_N = 0 and e_N = -(1, …, 1), the vertex o has from the point r of the simplex 1 >= r_0 >= … >= r_(N-1) >= 0
/// the squared distance min over t of Σ (r_i - o_i - t)², i = 0 … N: so all N+1 axes are alike, and the corners are e_0
/// + … + e_(k-1). How near another vertex comes is then a matter of isotonic regression: the pooled values in which o
/// rises where r falls; p zeros followed by q ones in the place of q ones followed by p zeros cost pq/(p+q). Below 3/4
/// that leaves (p, q) = (1, 1), (2, 1) and (1, 2), once at each corner.
template <int N>
struct NearVertex {
    static constexpr int kCount = 4 * (N + 1);

    int corner;       ///< So many steps lead to it.
    int step = N + 1; ///< One more: 0 … N - 1 along the axis of that rank, N along all; N + 1: none.
    int sign = 0;     ///< 1: that step is forwards, -1: back.

    /// The k-th of them, corner by corner, each followed by those a step from it.
    constexpr explicit NearVertex(int k) : corner(k / 4) {
        if (k % 4 == 0) return;
        step = (corner + (k % 4 < 3 ? k % 4 : N - 2)) % (N + 1); // the next two; the last but two that led to it
        sign = k % 4 < 3 ? 1 : -1;
    }

    /// x = y - unskew Σy moves a vertex y by so much along each axis.
    constexpr double tilt(double unskew) const {
        return -unskew * (corner + (step < N ? sign : step == N ? -N * sign : 0));
    }
    /// Its coordinates in space, from the lowest corner, are these; 1 more along the axes of rank below `corner`;
    /// `sign` more along that of rank `step`.
    constexpr double shift(double unskew) const { return tilt(unskew) - (step == N ? sign : 0); }
};

} // namespace curlew
