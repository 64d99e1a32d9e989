// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/vdb/MeshFile.h"
#include "curlew/vdb/Openvdb.h"

namespace curlew {

/// Unsigned distances to a mesh in a narrow band, and the closest faces.
struct MeshDistances {
    openvdb::FloatGrid::Ptr distance; ///< In world units.
    openvdb::Int32Grid::Ptr face;     ///< Indices of the closest faces at the active voxels of `distance`; triangles
                                      ///< come first, then quads.
};

/// Computes distances within `halfWidth` voxels, by OpenVDB's meshToVolume. Those are exact close to the mesh. Farther
/// out, OpenVDB considers only the closest faces of neighbours that it has already visited; if faces are about as small
/// as voxels, distances are too large by up to 0.7 voxels. Therefore each value beyond 1.75 voxels is compared with the
/// distances to the faces of those neighbours that are closer to the mesh, layer by layer outwards.
MeshDistances distancesTo(const Mesh& mesh, const openvdb::math::Transform& transform, double halfWidth,
                          const Monitor& monitor);

} // namespace curlew
