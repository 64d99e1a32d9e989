#include "curlew/vdb/MeshFile.h"

#include "MeshChecks.h"
#include "curlew/base/InputFile.h"

#include <assimp/Importer.hpp>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <tuple>
#include <utility>

namespace curlew {

namespace {

namespace fs = std::filesystem;

/// Collects faces and joins points with the same position.
class Collector {
  public:
    void add(const aiMesh& mesh, const aiMatrix4x4& transform) {
        const auto first = uint32_t(mCorners.size());
        for (unsigned n = 0; n < mesh.mNumVertices; ++n) {
            const aiVector3D p = transform * mesh.mVertices[n];
            mCorners.emplace_back(p.x + 0.0f, p.y + 0.0f, p.z + 0.0f); // -0 becomes 0
        }
        // Assimp marks a mesh where it has cut polygons: two triangles in a row that begin with the same corner were a
        // quad.
        const bool quadsWereCut = (mesh.mPrimitiveTypes & aiPrimitiveType_NGONEncodingFlag) != 0;
        for (unsigned n = 0; n < mesh.mNumFaces; ++n) {
            const unsigned* a = mesh.mFaces[n].mIndices;
            const unsigned* b = n + 1 < mesh.mNumFaces ? mesh.mFaces[n + 1].mIndices : nullptr;
            if (mesh.mFaces[n].mNumIndices == 4) {
                mMesh.quads.emplace_back(first + a[0], first + a[1], first + a[2], first + a[3]);
            } else if (quadsWereCut && b && a[0] == b[0] && a[2] == b[1]) {
                mMesh.quads.emplace_back(first + a[0], first + a[1], first + a[2], first + b[2]);
                ++n;
            } else {
                mMesh.triangles.emplace_back(first + a[0], first + a[1], first + a[2]);
            }
        }
    }

    void add(const std::vector<openvdb::Vec3s>& points, const std::vector<uint32_t>& corners,
             const std::vector<uint32_t>& sizes) {
        for (const auto& p : points) mCorners.emplace_back(p.x() + 0.0f, p.y() + 0.0f, p.z() + 0.0f);
        const uint32_t* face = corners.data();
        for (const uint32_t size : sizes) {
            if (size == 4)
                mMesh.quads.emplace_back(face[0], face[1], face[2], face[3]);
            else
                mMesh.triangles.emplace_back(face[0], face[1], face[2]);
            face += size;
        }
    }

    /// Points come in the order in which the file has them.
    Mesh joined() {
        std::vector<uint32_t> used;
        used.reserve(3 * mMesh.triangles.size() + 4 * mMesh.quads.size());
        for (const auto& face : mMesh.triangles) used.insert(used.end(), face.asV(), face.asV() + 3);
        for (const auto& face : mMesh.quads) used.insert(used.end(), face.asV(), face.asV() + 4);
        tbb::parallel_sort(used, [&](uint32_t i, uint32_t j) {
            const openvdb::Vec3s &a = mCorners[i], &b = mCorners[j];
            return std::tuple(a.x(), a.y(), a.z(), i) < std::tuple(b.x(), b.y(), b.z(), j);
        });

        constexpr uint32_t none = ~uint32_t(0);
        std::vector<uint32_t> joined(mCorners.size(), none); // first with the same position, then index of the point
        for (size_t n = 0; n < used.size(); ++n) {
            const bool same = n > 0 && mCorners[used[n]] == mCorners[used[n - 1]];
            joined[used[n]] = same ? joined[used[n - 1]] : used[n];
        }
        for (uint32_t n = 0; n < joined.size(); ++n) {
            if (joined[n] == none) continue;
            if (joined[n] == n) {
                joined[n] = uint32_t(mMesh.points.size());
                mMesh.points.push_back(mCorners[n]);
            } else {
                joined[n] = joined[joined[n]];
            }
        }
        for (auto& face : mMesh.triangles)
            for (int k = 0; k < 3; ++k) face[k] = joined[face[k]];
        for (auto& face : mMesh.quads)
            for (int k = 0; k < 4; ++k) face[k] = joined[face[k]];
        return std::move(mMesh);
    }

  private:
    std::vector<openvdb::Vec3s> mCorners;
    Mesh mMesh;
};

void collect(const aiScene& scene, const aiNode& node, const aiMatrix4x4& parent, Collector& collector) {
    const aiMatrix4x4 transform = parent * node.mTransformation;
    for (unsigned n = 0; n < node.mNumMeshes; ++n) collector.add(*scene.mMeshes[node.mMeshes[n]], transform);
    for (unsigned n = 0; n < node.mNumChildren; ++n) collect(scene, *node.mChildren[n], transform, collector);
}

/// Checks what Assimp has read of so many faces, since its own steps trust it. Returns whether there are larger
/// polygons than quads.
bool checkScene(const aiScene& scene, size_t expectedFaces, const MeshSource& source) {
    size_t faces = 0, points = 0, bad = 0;
    bool polygons = false;
    for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
        const aiMesh& mesh = *scene.mMeshes[m];
        for (unsigned n = 0; n < mesh.mNumVertices; ++n) {
            const aiVector3D& p = mesh.mVertices[n];
            bad += !(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
        }
        points += mesh.mNumVertices;
        for (unsigned n = 0; n < mesh.mNumFaces; ++n) {
            const aiFace& face = mesh.mFaces[n];
            if (face.mNumIndices < 3 || std::any_of(face.mIndices, face.mIndices + face.mNumIndices,
                                                    [&](unsigned i) { return i >= mesh.mNumVertices; }))
                throw source.error("it has a face without three points; it is damaged");
            polygons = polygons || face.mNumIndices > 4;
        }
        faces += mesh.mNumFaces;
    }
    if (faces == 0) throw source.noFaces();
    if (faces != expectedFaces)
        throw source.error(
            fmt::format("Assimp finds {} of its {} faces; write it with another program", faces, expectedFaces));
    source.checkFinite(bad, points);
    return polygons;
}

std::string extensionOf(const fs::path& path) {
    std::string extension = path.extension().string();
    for (char& c : extension) c = char(std::tolower(static_cast<unsigned char>(c)));
    return extension.empty() ? extension : extension.substr(1);
}

std::string contentOf(const fs::path& path) {
    std::ifstream in = openToRead(path);
    try {
        std::string content(size_t(in.seekg(0, std::ios::end).tellg()), '\0');
        in.seekg(0).read(content.data(), std::streamsize(content.size()));
        return content;
    } catch (const std::ios_base::failure&) {
        throw FileError(fmt::format("cannot read '{}': the disk did not give all of it; copy it again", path.string()));
    }
}

/// The mesh in the content of a file of that kind.
Mesh meshIn(std::string content, const std::string& extension, const MeshSource& source) {
    const size_t faces = checkMesh(content, extension, source);
    Assimp::Importer importer;
    const aiScene* scene = importer.ReadFileFromMemory(content.data(), content.size(), 0, extension.c_str());
    if (!scene) {
        std::string why = importer.GetErrorString();
        std::replace(why.begin(), why.end(), '\n', ' ');
        throw source.error(why + "; write it again");
    }
    if (checkScene(*scene, faces, source)) scene = importer.ApplyPostProcessing(aiProcess_Triangulate);
    Collector collector;
    if (scene && scene->mRootNode) collect(*scene, *scene->mRootNode, aiMatrix4x4(), collector);
    Mesh mesh = collector.joined();
    if (mesh.faces() == 0) throw source.noFaces();
    return mesh;
}

/// Throws ValueError for faces that are none.
void checkFaces(const std::vector<openvdb::Vec3s>& points, const std::vector<uint32_t>& corners,
                const std::vector<uint32_t>& sizes) {
    if (sizes.empty()) throw ValueError("the mesh has no faces");
    size_t needed = 0;
    for (size_t n = 0; n < sizes.size(); ++n) {
        if (sizes[n] < 3) throw ValueError(fmt::format("face {} of the mesh has {} corners", n, sizes[n]));
        needed += sizes[n];
    }
    if (needed != corners.size())
        throw ValueError(
            fmt::format("the faces of the mesh have {} corners, and {} are given", needed, corners.size()));
    for (size_t n = 0; n < corners.size(); ++n)
        if (corners[n] >= points.size())
            throw ValueError(
                fmt::format("corner {} of the mesh is point {}, and there are {}", n, corners[n], points.size()));
    for (size_t n = 0; n < points.size(); ++n)
        if (!std::isfinite(points[n].x()) || !std::isfinite(points[n].y()) || !std::isfinite(points[n].z()))
            throw ValueError(fmt::format("point {} of the mesh is not finite; repair it", n));
}

/// The content of a .ply file with these faces.
std::string plyOf(const std::vector<openvdb::Vec3s>& points, const std::vector<uint32_t>& corners,
                  const std::vector<uint32_t>& sizes) {
    std::string ply = fmt::format(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float "
        "z\nelement face {}\nproperty list uint uint vertex_indices\nend_header\n",
        points.size(), sizes.size());
    const auto put = [&](const void* data, size_t bytes) { ply.append(static_cast<const char*>(data), bytes); };
    for (const auto& point : points) put(point.asV(), sizeof point);
    const uint32_t* face = corners.data();
    for (const uint32_t size : sizes) {
        put(&size, sizeof size);
        put(face, size * sizeof *face);
        face += size;
    }
    return ply;
}

} // namespace

Mesh readMesh(const fs::path& path) {
    const MeshSource source{path};
    const std::string extension = extensionOf(path);
    if (extension != "obj" && extension != "ply" && extension != "stl")
        throw source.error(fmt::format("it is called .{}; give an .obj, .ply or .stl file", extension));
    return meshIn(contentOf(path), extension, source);
}

Mesh meshOf(const std::vector<openvdb::Vec3s>& points, const std::vector<uint32_t>& corners,
            const std::vector<uint32_t>& sizes) {
    checkFaces(points, corners, sizes);
    if (std::any_of(sizes.begin(), sizes.end(), [](uint32_t size) { return size > 4; }))
        return meshIn(plyOf(points, corners, sizes), "ply", {"polygons"}); // cut as those of files are
    Collector collector;
    collector.add(points, corners, sizes);
    return collector.joined();
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
