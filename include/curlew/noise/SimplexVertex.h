// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace curlew {

/// A lattice vertex of SimplexNoise that is within √(3/4) of some point of a simplex. From the simplex's lowest corner,
/// steps along the axes lead to the other corners, in the order of the point's skewed coordinates, largest first. One
/// more step, by -1 along all axes, leads back. A near vertex is a corner, or one such step away from a corner.
///
/// Derivation: let r_N = 0 and e_N = -(1, …, 1). The squared distance of the vertex o from the point r of the simplex,
/// 1 >= r_0 >= … >= r_(N-1) >= 0, is the minimum over t of Σ (r_i - o_i - t)², i = 0 … N. All N+1 axes are therefore
/// equivalent, and the corners are e_0 + … + e_(k-1). The least distance of another vertex is a problem of isotonic
/// regression, which pools the values where o rises while r falls. Replacing q ones followed by p zeros with p zeros
/// followed by q ones costs a squared distance of pq/(p+q).
///
/// Below 3/4, that leaves (p, q) = (1, 1), (2, 1) and (1, 2), once at each corner.
template <int N>
struct NearVertex {
    static constexpr int kCount = 4 * (N + 1);

    int corner;       ///< Number of steps from the lowest corner to the corner.
    int step = N + 1; ///< One more step: 0 … N - 1: along the axis of that rank; N: along all axes; N + 1: none.
    int sign = 0;     ///< 1: that step is forwards; -1: backwards; 0: none.

    /// The k-th near vertex. Each corner is followed by the vertices that are one step away from it.
    constexpr explicit NearVertex(int k) : corner(k / 4) {
        if (k % 4 == 0) return;
        // Forwards: the two steps after the next one. Backwards: the third-last step that led to the corner.
        step = (corner + (k % 4 < 3 ? k % 4 : N - 2)) % (N + 1);
        sign = k % 4 < 3 ? 1 : -1;
    }

    /// Returns -unskew Σy, by which x = y - unskew Σy moves the vertex y along each axis.
    constexpr double tilt(double unskew) const {
        return -unskew * (corner + (step < N ? sign : step == N ? -N * sign : 0));
    }
    /// Returns the part that all coordinates of the vertex share, in space and relative to the lowest corner. Axes of
    /// rank below `corner` have 1 more, and the axis of rank `step` has `sign` more.
    constexpr double shift(double unskew) const { return tilt(unskew) - (step == N ? sign : 0); }
};

} // namespace curlew
