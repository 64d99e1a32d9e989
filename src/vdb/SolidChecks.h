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
/// direction, they bound nothing together and none is kept. But if most of the mesh consists of such groups, or if it
/// has fewer boundary edges with them, they are made to be seen from both sides, and one of each is kept.
Mesh distinctTriangles(const Mesh& mesh, size_t& duplicates);

/// Makes neighbouring triangles agree on which side is outside: in each part that is connected by edges between two
/// triangles, reverses those that run against the others, and returns their number. Leaves parts alone that have only
/// one side, such as a Möbius strip.
size_t orient(Mesh& triangles);

/// Returns a vertex of each edge that is not used equally often in both directions. If there is none, winding numbers
/// are integers.
std::vector<openvdb::Index32> unbalancedEdges(const Mesh& mesh);
inline bool isOriented(const Mesh& mesh) { return unbalancedEdges(mesh).empty(); }

/// Returns the enclosed volume, positive if the faces run counter-clockwise as seen from outside (divergence theorem,
/// with the centre of the mesh's box as origin).
double volumeOf(const Mesh& mesh);

} // namespace curlew
