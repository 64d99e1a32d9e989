// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/vdb/MeshFile.h"

#include <openvdb/openvdb.h>

#include <functional>

namespace curlew {

/// Appends quads of the surface |w| = 1/2 to a mesh, wherever it is not one of the faces: across holes. `known` holds w
/// at the active voxels, all of those beside the faces among them; `extend(voxels)` computes others, where the surface
/// goes on; `at(ijk)` is w anywhere, in voxels.
///
/// Across a face w jumps by 1, so an edge between voxels whose w differ by less than 0.7 is crossed by the surface
/// itself. The cells around such edges have a vertex each, in the middle of the crossings of their edges (naive surface
/// nets, Gibson 1998).
void appendHoleSurface(openvdb::FloatTree& known, const std::function<void(const std::vector<openvdb::Coord>&)>& extend,
                       const std::function<double(const openvdb::Vec3d&)>& at,
                       const openvdb::math::Transform& transform, Mesh& mesh, const Monitor& monitor);

} // namespace curlew
