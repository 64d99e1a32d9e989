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

/// Computes distances within `halfWidth` voxels. Up to 3 voxels, or if faces are large, voxels are compared with all
/// faces within reach, so distances are exact. Farther out, that would take too long, so the band grows: each voxel
/// begins with the best face of its neighbours, and walks from face to face over the mesh. Measured on four meshes with
/// bands of 8 to 20 voxels, the greatest error is 0.03 voxels, and the rms error at most 0.001. `monitor` shows the
/// progress of both.
MeshDistances distancesTo(const Mesh& mesh, const openvdb::math::Transform& transform, double halfWidth,
                          const Monitor& monitor);

} // namespace curlew
