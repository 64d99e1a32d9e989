// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Bound.h"

#include <optional>
#include <vector>

namespace curlew {

/// The region of a flow: a box, and one side or both sides of an optional wall in it.
template <int N>
struct DomainN {
    BoxN<N> box = BoxN<N>{}.padded(1);
    std::optional<WallN<N>> wall;

    /// Returns the domain of a wall. For Side::inside its box is the box around the shape. Otherwise that box is
    /// enlarged by `padding` world units on each side (negative: half its longest edge). If the shape is unbounded, it
    /// is the default box.
    static DomainN of(const WallN<N>& wall, double padding = -1);
};
using Domain = DomainN<3>;

/// Returns how far a point is on the wrong side of the wall in world units: positive there, negative where the flow is
/// allowed. For Side::both it is never positive.
double beyondWall(Side side, double distance);

/// Rounding error of a position whose coordinates are floats, relative to the sum of their absolute values.
inline constexpr double kPositionRounding = 0x1p-23;

/// Tests whether points are on a side of the wall where the flow is allowed, at a distance of at least the rounding
/// error of their coordinates in float, so that this stays true after they are written to a file. Writes a flag and the
/// distance for each point. Without a wall all points are allowed, at an infinite distance. Does not test the box.
template <int N>
void classify(const DomainN<N>& domain, const PointBatchN<N>& points, std::array<bool, kBatch>& allowed,
              std::array<double, kBatch>& distance);

/// Returns the volume of the domain in cubic world units, accurate to about 1 % of its box. Uses the same 8192
/// positions at every call.
double volumeOf(const Domain& domain);

/// An interval of signed distances; ignored if the domain has no wall.
struct DistanceRange {
    double lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();
};

/// Returns the cells of a regular lattice that meet the box of the domain and may hold points within the range of
/// distances, in lexicographic order. Cell (i,j,k) is the box of edge `size` with the lower corner origin + size
/// (i,j,k). Subdivides large cells, so the cost grows with the number of returned cells, not with the volume of the
/// box. Throws ResourceError if there are more than `limit` cells, and ValueError if `size` is not positive and finite,
/// if it is too small for the box, or if the box is infinite.
std::vector<Vec<int, 3>> coveringCells(const Domain& domain, const Vec3d& origin, double size,
                                       const DistanceRange& range, size_t limit);

} // namespace curlew
