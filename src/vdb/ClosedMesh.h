// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/vdb/MeshFile.h"

#include <openvdb/openvdb.h>

namespace curlew {

/// A level set, but for what is outside of its band, of a mesh of triangles that is closed, manifold and oriented: its
/// signs are those of the sides of the closest faces. Null where that is not the solid: if voxels with no face between
/// them are on different sides, then the mesh crosses itself, and if shells lie in each other other than as cavities.
/// `turned`: faces run clockwise as seen from outside.
openvdb::FloatGrid::Ptr closedLevelSet(const Mesh& mesh, const openvdb::math::Transform& transform, double halfWidth,
                                       bool& turned, const Monitor& monitor);

} // namespace curlew
