// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "SolidWinding.h"
#include "curlew/vdb/MeshFile.h"

#include <cstdint>

namespace curlew {

/// The connected parts of a triangle mesh, where triangles are connected by vertices.
struct MeshShells {
    std::vector<uint32_t> ofTriangle; ///< The shell of each triangle; shells are numbered by their first triangle.
    size_t count = 0;
};

MeshShells shellsOf(const Mesh& mesh);

/// Reverses the faces of closed shells that run against the largest one but reach out of the others, such as the
/// mirrored eye of a character: they are no cavities, and would leave a hollow where they overlap. `mesh` must be
/// closed and oriented (isOriented()). Returns the number of shells. Up to 32 triangles of each shell are examined; a
/// tenth must be outside the others.
size_t turnProtruding(Mesh& mesh, const Monitor& monitor);

/// Returns the closed shells of a triangle mesh that also has open ones, without cavities of the open ones. A cavity is
/// a shell whose faces point inward, with w > 1/2 on average and w > 1/4 on nine in ten of up to 32 of its triangles, w
/// of the open shells together. Returns a mesh without faces if there are none, or if no shell is open. A shell is
/// closed if each edge is used equally often in both directions.
Mesh closedBesideOpen(const Mesh& mesh, const Monitor& monitor);

/// Closed shells that lie inside a solid and bound nothing.
struct FilledShells {
    size_t count = 0, faces = 0;
    double volume = 0; ///< The sum of their volumes, cubic world units.
};

/// Finds the closed shells of a triangle mesh that bound nothing since both of their sides are inside the solid |w| >
/// 1/2. Up to 32 triangles of each shell are examined; all must lie inside.
FilledShells filledShells(const Mesh& mesh, const SolidWinding& winding, const Monitor& monitor);

} // namespace curlew
