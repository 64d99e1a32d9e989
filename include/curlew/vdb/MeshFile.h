// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openvdb/Types.h>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <vector>

namespace curlew {

/// A polygon mesh as OpenVDB's mesh tools take it: corners are indices into `points`.
struct Mesh {
    std::vector<openvdb::Vec3s> points; ///< World units; no two have the same position when read from a file.
    std::vector<openvdb::Vec3I> triangles;
    std::vector<openvdb::Vec4I> quads;

    size_t faces() const { return triangles.size() + quads.size(); }
};

/// Reads the faces of an .obj, .ply or .stl file (the extension in any case). Triangles and quads stay what they are,
/// larger polygons become triangles; all objects of the file become one mesh, points with the same position are joined
/// and those of no face are dropped. Normals, colours, UVs, materials, lines and free-form surfaces are not read.
/// Throws FileError, naming the file, if it is missing, empty, cut short, of another kind or without faces, if a corner
/// does not exist or if a coordinate is not a finite number. An .obj that was cut between two faces cannot be told from
/// a whole one, except by its topology. Safe to call from several threads.
Mesh readMesh(const std::filesystem::path& path);

/// The mesh that readMesh() makes of a file with these points and faces: `corners` has those of all faces, one face
/// after another, and `sizes` how many each has. Throws ValueError where there are no faces, where one has fewer than
/// three corners or a corner that does not exist, and for coordinates that are not finite.
Mesh meshOf(const std::vector<openvdb::Vec3s>& points, const std::vector<uint32_t>& corners,
            const std::vector<uint32_t>& sizes);

/// Writes a mesh as a binary .ply or an .obj, as the extension says, whole or not at all (see writeAtomically).
/// Positions keep all their bits, faces their corners in order. Throws ValueError for another extension, positions that
/// are not finite and corners that do not exist; FileError if the file cannot be written; Interrupted once `cancelled`
/// says so.
void writeMesh(const std::filesystem::path& path, const Mesh& mesh, const std::function<bool()>& cancelled = {});

/// How the faces of a mesh hang together. An edge is a pair of points; two faces share it whatever their orientation.
struct MeshTopology {
    size_t faces = 0;            ///< Faces with at least three different corners.
    size_t degenerateFaces = 0;  ///< The others; their edges are not counted.
    size_t boundaryEdges = 0;    ///< Edges of exactly one face.
    size_t nonManifoldEdges = 0; ///< Edges of more than two faces.

    /// The mesh has an inside.
    bool closed() const { return boundaryEdges == 0 && faces > 0; }
};

MeshTopology topologyOf(const Mesh& mesh);

} // namespace curlew
