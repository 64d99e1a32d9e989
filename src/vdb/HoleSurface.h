// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/vdb/MeshFile.h"
#include "curlew/vdb/Openvdb.h"

#include <functional>

namespace curlew {

/// Appends quads of the surface |w| = 1/2 to a mesh wherever it does not coincide with a face: across holes. `known`
/// holds w at its active voxels, which include all voxels next to the faces. `extend(voxels)` adds w at further voxels,
/// where the surface continues. `at(ijk)` returns w at any position, in voxels.
///
/// Across a face, w jumps by 1. So if the values at the two ends of an edge lie on different sides of 1/2 but differ by
/// less than 0.7, the surface itself crosses the edge. Each cell around such an edge gets a vertex at the mean of the
/// crossings on its edges (naive surface nets, Gibson 1998).
void appendHoleSurface(openvdb::FloatTree& known, const std::function<void(const std::vector<openvdb::Coord>&)>& extend,
                       const std::function<double(const openvdb::Vec3d&)>& at,
                       const openvdb::math::Transform& transform, Mesh& mesh, const Monitor& monitor);

} // namespace curlew
