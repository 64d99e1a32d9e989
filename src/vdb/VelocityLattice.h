// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/GridFlow.h"
#include "curlew/vdb/Openvdb.h"

namespace curlew {

/// The components of a velocity grid on one lattice of cubes. Component k of voxel ijk is that of grid k at ijk.
struct VelocityLattice {
    std::array<openvdb::FloatGrid::ConstPtr, 3> components;
    bool staggered = false; ///< Component k is at the lower face along axis k, not at the centre of the voxel.
    Matrix3 toIndex;        ///< Index coordinates are toIndex * x + shift; centres of voxels have integers.
    Vec3d shift;
    Matrix3 axes;              ///< Row k: the direction of index axis k in world space, of length 1.
    double voxel = 0;          ///< World units.
    bool mirrored = false;     ///< The index axes are left-handed.
    openvdb::CoordBBox active; ///< All active voxels of the three grids.

    /// Whether the components are along the axes of world space.
    bool alongWorld() const { return !staggered || axes == Matrix3{}; }
};

/// Throws ValueError as sampledFlow() does.
VelocityLattice latticeOf(const VelocityGrids& grids);

} // namespace curlew
