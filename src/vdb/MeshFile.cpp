// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/MeshFile.h"

#include "MeshParser.h"
#include "curlew/base/InputFile.h"
#include "curlew/base/Memory.h"

#include <fmt/format.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cctype>
#include <utility>

namespace curlew {

namespace {

namespace fs = std::filesystem;

/// Throws ValueError if a face or a point is invalid.
void checkFaces(const std::vector<openvdb::Vec3s>& points, const std::vector<uint32_t>& corners,
                const std::vector<uint32_t>& sizes) {
    if (sizes.empty()) throw ValueError("the mesh has no faces");
    size_t needed = 0;
    for (size_t n = 0; n < sizes.size(); ++n) {
        if (sizes[n] < 3)
            throw ValueError(fmt::format("face {} of the mesh has {} corners; it needs at least 3", n, sizes[n]));
        needed += sizes[n];
    }
    if (needed != corners.size())
        throw ValueError(
            fmt::format("the faces of the mesh have {} corners, but {} are given", needed, corners.size()));
    for (size_t n = 0; n < corners.size(); ++n)
        if (corners[n] >= points.size())
            throw ValueError(fmt::format("corner {} of the mesh is point {}, but there are {} points", n, corners[n],
                                         points.size()));
    for (size_t n = 0; n < points.size(); ++n)
        if (!points[n].isFinite()) throw ValueError(fmt::format("point {} of the mesh is not finite; repair it", n));
}

} // namespace

std::string contentOf(const fs::path& path) {
    std::ifstream in = openToRead(path);
    try {
        std::string content(static_cast<size_t>(in.seekg(0, std::ios::end).tellg()), '\0');
        in.seekg(0).read(content.data(), static_cast<std::streamsize>(content.size()));
        return content;
    } catch (const std::ios_base::failure&) {
        throw FileError(fmt::format("cannot read '{}': only part of it could be read; copy it again", path.string()));
    }
}

std::string extensionOf(const fs::path& path) {
    std::string extension = path.extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return extension;
}

Mesh readMesh(const fs::path& path, const Monitor& monitor) {
    const MeshSource source{path, monitor};
    const std::string extension = extensionOf(path);
    // The file, its polygons and the mesh, relative to the size of the file: text is larger than what it says.
    const double bytesPerByte = extension == ".obj" ? 2.2 : 4.2;
    requireMemory(bytesPerByte * static_cast<double>(fs::is_regular_file(path) ? fs::file_size(path) : 0),
                  fmt::format("'{}'", path.string()), "give a mesh with fewer faces");
    if (extension == ".obj") return meshOf(parseObj(contentOf(path), source));
    if (extension == ".ply") return meshOf(parsePly(contentOf(path), source));
    if (extension == ".stl") return meshOf(parseStl(contentOf(path), source));
    throw source.error(fmt::format("its extension is '{}'; give an .obj, .ply or .stl file", extension));
}

Mesh meshOf(const std::vector<openvdb::Vec3s>& points, const std::vector<uint32_t>& corners,
            const std::vector<uint32_t>& sizes) {
    checkFaces(points, corners, sizes);
    return meshOf(Polygons{points, corners, sizes});
}

MeshTopology topologyOf(const Mesh& mesh) {
    MeshTopology topology;
    std::vector<std::pair<uint32_t, uint32_t>> edges;
    edges.reserve(3 * mesh.triangles.size() + 4 * mesh.quads.size());
    const auto add = [&](const uint32_t* corners, size_t count) {
        size_t different = 0;
        for (size_t k = 0; k < count; ++k) different += std::find(corners, corners + k, corners[k]) == corners + k;
        if (different < 3) {
            ++topology.degenerateFaces;
            return;
        }
        ++topology.faces;
        for (size_t k = 0; k < count; ++k) {
            const uint32_t next = corners[(k + 1) % count];
            if (corners[k] != next) edges.emplace_back(std::min(corners[k], next), std::max(corners[k], next));
        }
    };
    for (const auto& face : mesh.triangles) add(face.asV(), 3);
    for (const auto& face : mesh.quads) add(face.asV(), 4);
    tbb::parallel_sort(edges);
    for (auto edge = edges.begin(); edge != edges.end();) {
        const auto next = std::find_if(edge, edges.end(), [&](const auto& other) { return other != *edge; });
        topology.boundaryEdges += next - edge == 1;
        topology.nonManifoldEdges += next - edge > 2;
        edge = next;
    }
    return topology;
}

} // namespace curlew
