// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/field/ScalarField.h"
#include "curlew/vdb/MeshFile.h"
#include "curlew/vdb/Openvdb.h"

#include <array>

namespace curlew {

/// A surface whose points move.
struct MovingSurface {
    const Mesh& mesh;
    const std::vector<openvdb::Vec3s>& velocities; ///< Of the points of the mesh, world units per second.
};

/// Returns the velocity of the closest point of the surface, as Sdf::surfaceVelocity needs it, at positions within
/// `reach` world units. It is computed at voxels of size `voxel`, from the velocities at the vertices of the closest
/// face by barycentric weights, and interpolated between them by tricubic B-splines. Beyond the reach it falls to zero.
/// Throws ResourceError if the voxels would not fit in memory.
std::array<ScalarField, 3> surfaceVelocity(const MovingSurface& surface, double voxel, double reach,
                                           const Monitor& monitor);

} // namespace curlew
