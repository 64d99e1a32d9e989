// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/MeshFile.h"

#include <cstdint>
#include <vector>

namespace curlew {

/// Faces of any size.
struct Polygons {
    std::vector<openvdb::Vec3s> points = {};
    std::vector<uint32_t> corners = {}; ///< Indices into points: those of all faces, one face after another.
    std::vector<uint32_t> sizes = {};   ///< How many corners each face has, at least 3.
};

/// Cuts faces of more than four corners into triangles, joins points with the same position and drops unused ones. The
/// points keep their order, and faces their corners in order.
///
/// A polygon is projected along its normal and loses one ear after another (Meisters 1975), the first found being the
/// next to go; concave polygons are covered once. If a polygon has no ear, because it crosses itself, the next corner
/// goes: the triangles still use every edge of the polygon once.
Mesh meshOf(const Polygons& polygons);

struct JoinedMesh {
    Mesh mesh;
    std::vector<uint32_t> sources; ///< Of each point of the mesh, that of the polygons.
};

/// The same, but points are joined only if they are also of the same group, and it says where they come from. `groups`:
/// one number for each point; none if all are of one.
JoinedMesh joinedMeshOf(const Polygons& polygons, const std::vector<uint32_t>& groups);

} // namespace curlew
