// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Flow.h"
#include "curlew/vdb/LevelSet.h"

#include <memory>

/// Meshes, and the flow in one of them, that several topics share.
namespace curlew::bench {

/// Returns the mesh scenes/spot.obj: 5856 triangles, closed.
std::shared_ptr<const Mesh> spot();

/// Returns a closed mesh of 12 n² triangles: a sphere with bumps, made of the faces of a cube.
std::shared_ptr<const Mesh> bumpyBall(int n);

/// Returns the level set that OpenVDB's meshToVolume makes of a closed mesh, `dim` voxels along its longest edge.
std::shared_ptr<openvdb::FloatGrid> openVdbLevelSet(const Mesh& mesh, int dim);

/// Returns the domain inside spot(), from a level set 192 voxels across. Its layer is a twelfth of its size.
const Domain& insideSpot();

/// Returns a flow of two noises of two octaves with an rms speed of 1: in insideSpot(), or in its box without the wall.
Flow flowInSpot(bool walled);

} // namespace curlew::bench
