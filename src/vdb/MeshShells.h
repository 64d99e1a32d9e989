// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/WindingNumber.h"

#include <cstdint>

namespace curlew {

/// The connected parts of a triangle mesh, where triangles are connected by vertices.
struct MeshShells {
    std::vector<uint32_t> ofTriangle; ///< The shell of each triangle; shells are numbered by their first triangle.
    size_t count = 0;
};

MeshShells shellsOf(const Mesh& mesh);

/// Closed shells that lie inside a solid and bound nothing.
struct FilledShells {
    size_t count = 0, faces = 0;
    double volume = 0; ///< The sum of their volumes, cubic world units.
};

/// Finds the closed shells of a triangle mesh that bound nothing since both of their sides are inside the solid |w| >
/// 1/2. Up to 32 triangles of each shell are examined; all must lie inside.
FilledShells filledShells(const Mesh& mesh, const WindingNumber& winding, const Monitor& monitor);

} // namespace curlew
