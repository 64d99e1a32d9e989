// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/GridTypes.h"
#include "curlew/vdb/MeshSolid.h"

#include <vector>

namespace curlew {

/// Name of the level set metadata that holds the thickness of a sheet, in world units.
inline constexpr const char* kThickness = "sheet_thickness";

/// Returns the thickness stored in a level set's metadata; 0 if there is none.
double thicknessOf(const openvdb::FloatGrid& grid);

/// Returns the mesh with each quad split along the diagonal from its first to its third vertex.
Mesh inTriangles(const Mesh& mesh);

/// Does the same, joins points at the same position, and removes degenerate triangles and duplicates, which it counts.
/// Of triangles with the same vertices one is kept, in the more frequent direction. If equally many run in either
/// direction, they bound nothing together and none is kept: `pairs` receives one of each such group. But if most of the
/// mesh consists of such groups, or if it has fewer boundary edges with them, they are made to be seen from both sides,
/// and one of each is kept.
Mesh distinctTriangles(const Mesh& mesh, size_t& duplicates, std::vector<openvdb::Vec3I>& pairs);

/// Makes neighbouring triangles agree on which side is outside: in each part that is connected by edges between two
/// triangles, reverses those that run against the others, and returns how many of the first `counted` these are. Leaves
/// parts alone that have only one side, such as a Möbius strip.
size_t orient(Mesh& triangles, size_t counted);

/// Returns the enclosed volume, positive if the faces run counter-clockwise as seen from outside (divergence theorem,
/// with the centre of the mesh's box as origin).
double volumeOf(const Mesh& mesh);

} // namespace curlew
