// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"

#include <openvdb/Types.h>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <vector>

namespace curlew {

/// A polygon mesh as OpenVDB's mesh tools take it. Faces hold indices into `points`.
struct Mesh {
    std::vector<openvdb::Vec3s> points; ///< World units; unique positions if read from a file.
    std::vector<openvdb::Vec3I> triangles;
    std::vector<openvdb::Vec4I> quads;
    std::vector<openvdb::Vec3s> normals = {}; ///< A unit normal for each point; empty if they are not known.
    std::vector<openvdb::Vec2s> uvs = {}; ///< Texture coordinates of each point, from 0 to 1; empty if there are none.

    size_t faces() const { return triangles.size() + quads.size(); }
};

/// Reads the faces of an .obj, .ply or .stl file; the case of the extension does not matter. Triangles and quads are
/// kept, larger polygons are triangulated. All objects of the file become one mesh. Points with the same position are
/// joined, and unused points are dropped. Normals, colours, UVs, materials, lines and free-form surfaces are ignored.
/// Throws FileError, naming the file, if it is missing, empty, truncated, of another kind or without faces, if a vertex
/// index is out of range, or if a coordinate is not a finite number. An .obj that was truncated between two faces looks
/// complete, except for its topology. Throws Interrupted. Safe to call from several threads.
Mesh readMesh(const std::filesystem::path& path, const Monitor& monitor = {});

/// Builds the mesh that readMesh() makes of a file with these points and faces. `corners` holds the vertex indices of
/// all faces, one face after another, and `sizes` the number of vertices of each face. Throws ValueError if there are
/// no faces, if a face has fewer than three vertices, if a vertex index is out of range, if the sizes do not add up to
/// the number of corners, or if a coordinate is not finite.
Mesh meshOf(const std::vector<openvdb::Vec3s>& points, const std::vector<uint32_t>& corners,
            const std::vector<uint32_t>& sizes);

/// Writes a mesh as a binary .ply or an .obj, depending on the extension. The file appears complete or not at all (see
/// writeAtomically). Positions keep all their bits, faces the order of their vertices. Normals and UVs are written if
/// the mesh has them: in a .ply as nx ny nz and s t, in an .obj as vn and vt. Throws ValueError if the extension is
/// another, a position is not finite, a vertex index is out of range, or normals or UVs do not match the points;
/// FileError if the file cannot be written; Interrupted once `cancelled` returns true.
void writeMesh(const std::filesystem::path& path, const Mesh& mesh, const std::function<bool()>& cancelled = {});

/// Connectivity of a mesh. An edge is an unordered pair of points: two faces share it whatever their orientation.
struct MeshTopology {
    size_t faces = 0;            ///< Faces with at least three distinct vertices.
    size_t degenerateFaces = 0;  ///< All other faces; their edges are not counted.
    size_t boundaryEdges = 0;    ///< Edges of exactly one face.
    size_t nonManifoldEdges = 0; ///< Edges of more than two faces.

    /// Whether the mesh can have an inside.
    bool closed() const { return boundaryEdges == 0 && faces > 0; }
};

MeshTopology topologyOf(const Mesh& mesh);

} // namespace curlew
