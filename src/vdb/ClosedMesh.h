// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/vdb/MeshFile.h"
#include "curlew/vdb/Openvdb.h"

namespace curlew {

/// Makes the narrow band of a level set of a closed, manifold and oriented triangle mesh. Values outside the band have
/// no sign yet. The side of the closest face gives the sign. Returns null if that does not give the solid: if
/// neighbouring voxels with no face between them have different signs, which means that the mesh crosses itself, or if
/// a shell lies inside another other than as a cavity. Sets `turned` if the faces run clockwise as seen from outside.
openvdb::FloatGrid::Ptr closedLevelSet(const Mesh& mesh, const openvdb::math::Transform& transform, double halfWidth,
                                       bool& turned, const Monitor& monitor);

} // namespace curlew
