// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "SolidFaces.h"
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

/// Reverses the faces of closed shells that run against the largest one but reach out of the other shells, such as the
/// mirrored eye of a character: they are no cavities, and would leave a hollow where they overlap. Returns their
/// number. Up to 32 triangles of each shell are examined; a tenth must be outside the others.
size_t turnProtruding(SolidFaces& faces, const Monitor& monitor);

/// The closed shells of a mesh that are solid by themselves, and all other triangles.
struct SolidShells {
    Mesh closed, others;
};

/// A closed shell is among the others if it is a cavity of the open ones: its faces point inward, and the winding
/// number w of the open ones is more than 1/2 on average and more than 1/4 on nine in ten of up to 32 of its triangles.
SolidShells solidShells(const SolidFaces& faces, const Monitor& monitor);

/// Closed shells that lie inside a solid and bound nothing.
struct FilledShells {
    size_t count = 0, faces = 0;
    double volume = 0; ///< The sum of their volumes, cubic world units.
};

/// Finds the closed shells of a mesh that bound nothing since both of their sides are inside the solid. Up to 32
/// triangles of each shell are examined; all must lie inside.
FilledShells filledShells(const SolidFaces& faces, const SolidWinding& winding, const Monitor& monitor);

} // namespace curlew
