// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Bound.h"

#include <optional>
#include <vector>

namespace curlew {

/// Where a flow is wanted: a box, and in it one side of a wall or both.
template <int N>
struct DomainN {
    BoxN<N> box = BoxN<N>{}.padded(1);
    std::optional<WallN<N>> wall;

    /// The domain of a wall: for the inside, the box around the shape; else that box with `padding` world units around
    /// it (negative: half its longest edge). An unbounded shape leaves the default box.
    static DomainN of(const WallN<N>& wall, double padding = -1);
};
using Domain = DomainN<3>;

/// How far a point is on the wrong side of the wall, world units: positive there, negative where the flow is allowed.
/// For Side::both, nowhere positive.
double beyondWall(Side side, double distance);

/// Whether points lie on a side of the wall that the flow may use, clear of it by at least a rounding of their
/// coordinates to float: so that they still do once they are in a file. Writes one flag per point; also the distance
/// itself. Without a wall every point does, at an infinite distance. The box is not judged.
template <int N>
void classify(const DomainN<N>& domain, const PointBatchN<N>& points, std::array<bool, kBatch>& allowed,
              std::array<double, kBatch>& distance);

/// The volume of the domain, cubic world units, within about 1 % of its box: from the same 8192 random positions each
/// time.
double volumeOf(const Domain& domain);

/// Signed distances that matter; where the domain has no wall they are not asked for.
struct DistanceRange {
    double lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();
};

/// The cells of a regular lattice (cell (i,j,k) is the box of edge `size` whose lower corner is origin + size (i,j,k))
/// that meet the box of the domain and may hold points within the range of distances. Found by subdivision from large
/// cells, so the cost goes with the number of cells returned, not with the volume of the box. Lexicographic order.
/// Throws ResourceError if there would be more than `limit`.
std::vector<Vec<int, 3>> coveringCells(const Domain& domain, const Vec3d& origin, double size,
                                       const DistanceRange& range, size_t limit);

} // namespace curlew
