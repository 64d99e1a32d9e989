// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/MeshSolid.h"

namespace curlew {

/// The metadata of a level set that says how thick a sheet its mesh is, world units.
inline constexpr const char* kThickness = "sheet_thickness";

/// The thickness that is noted in a level set; 0 if there is none.
double thicknessOf(const openvdb::FloatGrid& grid);

/// Quads cut from their first corner to their third.
Mesh inTriangles(const Mesh& mesh);

/// The same without degenerate triangles, points at the same position joined, and without duplicates, which are
/// counted: of triangles with the same corners one stays, of the direction that more of them have. Where as many run in
/// either direction they bound nothing together, and none stays; but of a mesh most of whose faces are like that, which
/// is made to be seen from both sides, one does.
Mesh distinctTriangles(const Mesh& mesh, size_t& duplicates);

/// Whether the faces run along each edge equally often in both directions, so that winding numbers are integers.
bool isOriented(const Mesh& mesh);

/// What a mesh encloses, positive if its faces run counter-clockwise as seen from outside (the divergence theorem, from
/// the middle of its box).
double volumeOf(const Mesh& mesh);

/// The share of the area of a mesh near which a level set is not negative a voxel away from it on either side, among
/// what is not deep inside: there the object is thinner than a voxel. Looks at up to about 20,000 faces.
double thinShare(const Mesh& mesh, const openvdb::FloatGrid& grid);

} // namespace curlew
