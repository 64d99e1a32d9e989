// SPDX-License-Identifier: Apache-2.0
#include "ChunkedWriter.h"
#include "MeshParser.h"
#include "curlew/base/AtomicFile.h"

#include <fmt/format.h>

#include <cstdint>
#include <iterator>
#include <limits>
#include <utility>

namespace curlew {

namespace {

/// Calls visit(faces) with the triangles, then with the quads.
template <class Visit>
void visitFaces(const Mesh& mesh, const Visit& visit) {
    visit(mesh.triangles);
    visit(mesh.quads);
}

void checkMesh(const Mesh& mesh) {
    for (const auto& p : mesh.points)
        if (!p.isFinite()) throw ValueError("the mesh has a position that is not finite");
    visitFaces(mesh, [&](const auto& faces) {
        for (const auto& face : faces)
            for (int k = 0; k < face.size; ++k)
                if (face[k] >= mesh.points.size())
                    throw ValueError("the mesh has a face with a vertex that does not exist");
    });
    for (const auto& [count, what] : {std::pair(mesh.normals.size(), "normals"), std::pair(mesh.uvs.size(), "UVs")})
        if (count != 0 && count != mesh.points.size())
            throw ValueError(fmt::format("the mesh has {} {} for {} points", count, what, mesh.points.size()));
    if (mesh.points.size() > std::numeric_limits<int32_t>::max())
        throw ValueError(fmt::format("a mesh of {} points is too large for a file", mesh.points.size()));
}

void writePlyMesh(std::ostream& out, const Mesh& mesh) {
    out << fmt::format(
        "ply\nformat binary_little_endian 1.0\ncomment Curlew\nelement vertex {}\nproperty float x\nproperty float y\n"
        "property float z\n{}{}element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.points.size(), mesh.normals.empty() ? "" : "property float nx\nproperty float ny\nproperty float nz\n",
        mesh.uvs.empty() ? "" : "property float s\nproperty float t\n", mesh.faces());
    writeChunks(out, mesh.points.size(), [&](size_t begin, size_t end, std::string& bytes) {
        for (size_t n = begin; n < end; ++n) {
            appendBytes(bytes, mesh.points[n]);
            if (!mesh.normals.empty()) appendBytes(bytes, mesh.normals[n]);
            if (!mesh.uvs.empty()) appendBytes(bytes, mesh.uvs[n]);
        }
    });
    visitFaces(mesh, [&](const auto& faces) {
        writeChunks(out, faces.size(), [&](size_t begin, size_t end, std::string& bytes) {
            for (size_t n = begin; n < end; ++n) {
                bytes.push_back(static_cast<char>(faces[n].size));
                appendBytes(bytes, faces[n]);
            }
        });
    });
}

void writeObjMesh(std::ostream& out, const Mesh& mesh) {
    out << "# Curlew\n";
    const auto writeLines = [&](const char* keyword, const auto& items) {
        writeChunks(out, items.size(), [&](size_t begin, size_t end, std::string& text) {
            for (size_t n = begin; n < end; ++n) {
                text += keyword;
                for (int k = 0; k < items[n].size; ++k) fmt::format_to(std::back_inserter(text), " {}", items[n][k]);
                text += '\n';
            }
        });
    };
    writeLines("v", mesh.points);
    writeLines("vt", mesh.uvs);
    writeLines("vn", mesh.normals);
    const bool uvs = !mesh.uvs.empty(), normals = !mesh.normals.empty();
    const auto appendCorner = [&](std::string& text, uint64_t index) { // v, v/vt, v//vn or v/vt/vn
        fmt::format_to(std::back_inserter(text), " {}", index);
        if (uvs) fmt::format_to(std::back_inserter(text), "/{}", index);
        if (normals) fmt::format_to(std::back_inserter(text), "{}{}", uvs ? "/" : "//", index);
    };
    visitFaces(mesh, [&](const auto& faces) {
        writeChunks(out, faces.size(), [&](size_t begin, size_t end, std::string& text) {
            for (size_t n = begin; n < end; ++n) {
                text += 'f';
                for (int k = 0; k < faces[n].size; ++k) appendCorner(text, uint64_t{faces[n][k]} + 1);
                text += '\n';
            }
        });
    });
}

} // namespace

void writeMesh(const std::filesystem::path& path, const Mesh& mesh, const std::function<bool()>& cancelled) {
    const std::string extension = extensionOf(path);
    if (extension != ".ply" && extension != ".obj")
        throw ValueError(
            fmt::format("a mesh cannot be written to '{}'; its name must end in .ply or .obj", path.string()));
    checkMesh(mesh);
    writeAtomically(
        path, [&](std::ostream& out) { extension == ".ply" ? writePlyMesh(out, mesh) : writeObjMesh(out, mesh); },
        cancelled);
}

} // namespace curlew
