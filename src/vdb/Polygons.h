// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/MeshFile.h"

#include <cstdint>
#include <vector>

namespace curlew {

/// A mesh with faces of any size.
struct Polygons {
    std::vector<openvdb::Vec3s> points = {};
    std::vector<uint32_t> corners = {}; ///< Vertex indices of all faces, one face after another.
    std::vector<uint32_t> sizes = {};   ///< Number of vertices of each face, at least 3.
};

/// Triangulates faces with more than four vertices, joins points with the same position and drops unused ones. Points
/// keep their order, and faces the order of their vertices.
///
/// A polygon is projected along its normal and triangulated by ear clipping (Meisters 1975): the next ear found is
/// always removed first. So concave polygons are covered once. If a polygon has no ear, because it crosses itself, the
/// next vertex is removed. The triangles then still use every edge of the polygon once.
Mesh meshOf(const Polygons& polygons);

struct JoinedMesh {
    Mesh mesh;
    std::vector<uint32_t> sources; ///< For each point of the mesh, its index in the polygons.
};

/// Does the same, but joins points only if they also belong to the same group, and returns where they come from.
/// `groups` has one number per point; if it is empty, all points belong to one group.
JoinedMesh joinedMeshOf(const Polygons& polygons, const std::vector<uint32_t>& groups);

} // namespace curlew
