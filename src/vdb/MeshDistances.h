// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/vdb/MeshFile.h"

#include <openvdb/openvdb.h>

namespace curlew {

/// Distances to a mesh in a narrow band, without signs, and the closest faces.
struct MeshDistances {
    openvdb::FloatGrid::Ptr distance; ///< World units.
    openvdb::Int32Grid::Ptr face;     ///< Numbers of faces at the active voxels of `distance`, triangles first.
};

/// Within `halfWidth` voxels, by OpenVDB's meshToVolume. That is exact close to the mesh; further out it knows only
/// the faces that are closest to neighbours which are already known, and where faces are about as small as voxels,
/// values are too large by up to 0.7 voxels. So beyond 1.75 voxels each value is compared with the distances to the
/// faces of the neighbours that are closer to the mesh, from the inside outwards.
MeshDistances distancesTo(const Mesh& mesh, const openvdb::math::Transform& transform, double halfWidth,
                          const Monitor& monitor);

} // namespace curlew
