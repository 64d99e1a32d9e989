// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"

namespace curlew {

/// The voxels of a grid: cubes along the axes of world space.
struct Voxels {
    double size = 0; ///< Of an edge, in world units.
    Vec3d origin{};  ///< Centre of the voxel with the index (0, 0, 0).

    /// Returns the world coordinate of an index coordinate along an axis; centres have integers.
    double at(int axis, double index) const { return origin[axis] + size * index; }
    /// Returns the index coordinate of a world coordinate along an axis.
    double index(int axis, double coordinate) const { return (coordinate - origin[axis]) / size; }
    /// Returns the centre of a voxel.
    Vec3d centre(int i, int j, int k) const { return {{at(0, i), at(1, j), at(2, k)}}; }

    bool operator==(const Voxels&) const = default;
};

} // namespace curlew
