// SPDX-License-Identifier: Apache-2.0
#include "SurfaceModel.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/RayMesh.h"

#include <openvdb/tools/VolumeToMesh.h>

#include <array>
#include <optional>
#include <unordered_map>

namespace curlew {

namespace {

using Triangle = Vec<uint32_t, 3>;

constexpr double kCrease = 0.5; ///< Minimum cosine between neighbouring faces; sharper edges stay creases.

/// From this number of faces at a vertex on, a face is compared with the mean of all of them instead of with each one,
/// which would take a time quadratic in their number.
constexpr size_t kCrowd = 1024;

bool smooth(const Vec3d& a, const Vec3d& b) { return dot(a, b) > kCrease * length(a) * length(b); }

/// Splits each quad into two triangles along its shorter diagonal.
std::vector<Triangle> trianglesOf(const Mesh& mesh, const std::vector<Vec3d>& vertices) {
    std::vector<Triangle> triangles;
    triangles.reserve(mesh.triangles.size() + 2 * mesh.quads.size());
    for (const auto& t : mesh.triangles) triangles.push_back({{t[0], t[1], t[2]}});
    for (const auto& q : mesh.quads) {
        const bool first = length(vertices[q[0]] - vertices[q[2]]) <= length(vertices[q[1]] - vertices[q[3]]);
        triangles.push_back(first ? Triangle{{q[0], q[1], q[2]}} : Triangle{{q[0], q[1], q[3]}});
        triangles.push_back(first ? Triangle{{q[0], q[2], q[3]}} : Triangle{{q[1], q[2], q[3]}});
    }
    return triangles;
}

/// The geometry for Embree.
struct Faces {
    std::vector<Vec3d> vertices; ///< World units.
    std::vector<Triangle> triangles;
};

Faces facesOf(const Mesh& mesh) {
    Faces faces;
    faces.vertices.reserve(mesh.points.size());
    for (const auto& p : mesh.points) {
        const openvdb::Vec3d q(p);
        faces.vertices.push_back({{q[0], q[1], q[2]}});
    }
    faces.triangles = trianglesOf(mesh, faces.vertices);
    return faces;
}

/// Extracts the zero set of a grid in index space, where float is precise enough wherever the grid lies. `place`
/// converts indices to a position.
template <class ToWorld>
Faces facesOf(const openvdb::FloatGrid& grid, const ToWorld& toWorld) {
    const auto indices = grid.copyReplacingTransform(openvdb::math::Transform::createLinearTransform(1));
    Mesh mesh;
    openvdb::tools::volumeToMesh(*indices, mesh.points, mesh.triangles, mesh.quads, 0.0, 0.0, true);
    Faces faces = facesOf(mesh);
    for (Vec3d& p : faces.vertices) p = toWorld(p);
    return faces;
}

/// A mesh with a normal per corner of a face: the area-weighted mean of the faces around the vertex that are not across
/// a crease. At a vertex of a thousand faces it is the mean of all of them, or the face's own if that is across a
/// crease.
class MeshSurface final : public Surface::Model {
  public:
    explicit MeshSurface(Faces faces)
        : mMesh(std::move(faces.vertices), std::move(faces.triangles)), mNormals(mMesh.triangles().size()) {
        findNormals();
    }

    double rayOffset() const override { return 1e-4 * length(mMesh.box().size()); }

    void intersect(std::span<const Ray> rays, double, std::span<RayHit> hits) const override {
        std::vector<std::optional<RayMesh::Hit>> found(rays.size());
        mMesh.hits(rays, found);
        for (size_t k = 0; k < rays.size(); ++k) hits[k] = found[k] ? seen(rays[k], *found[k]) : RayHit{};
    }

    void occluded(std::span<const Ray> rays, double, std::span<uint8_t> flags) const override {
        mMesh.occluded(rays, flags);
    }

  private:
    Vec3d areaVector(const Triangle& t) const {
        const auto& v = mMesh.vertices();
        return cross(v[t[1]] - v[t[0]], v[t[2]] - v[t[0]]);
    }

    void findNormals() {
        const auto& triangles = mMesh.triangles();
        std::vector<size_t> first(mMesh.vertices().size() + 1);
        for (const Triangle& t : triangles)
            for (const uint32_t v : t.c) ++first[v + 1];
        for (size_t k = 1; k < first.size(); ++k) first[k] += first[k - 1];
        std::vector<size_t> next(first.begin(), first.end() - 1), around(first.back());
        std::vector<Vec3d> areas;
        areas.reserve(triangles.size());
        for (size_t k = 0; k < triangles.size(); ++k) {
            areas.push_back(areaVector(triangles[k]));
            for (const uint32_t v : triangles[k].c) around[next[v]++] = k;
        }
        const auto crowded = [&](uint32_t v) { return first[v + 1] - first[v] >= kCrowd; };
        std::unordered_map<uint32_t, Vec3d> crowds; // sums over all faces
        for (uint32_t v = 0; v + 1 < first.size(); ++v)
            for (size_t n = first[v]; crowded(v) && n < first[v + 1]; ++n) crowds[v] += areas[around[n]];
        for (size_t k = 0; k < triangles.size(); ++k)
            for (size_t corner = 0; corner < 3; ++corner) {
                const uint32_t v = triangles[k].c[corner];
                Vec3d sum = areas[k];
                if (crowded(v)) {
                    if (smooth(crowds.at(v), areas[k])) sum = crowds.at(v);
                } else {
                    for (size_t n = first[v]; n < first[v + 1]; ++n)
                        if (around[n] != k && smooth(areas[around[n]], areas[k])) sum += areas[around[n]];
                }
                const double size = length(sum);
                for (int axis = 0; axis < 3; ++axis)
                    mNormals[k][corner][axis] = size > 0 ? static_cast<float>(sum[axis] / size) : 0;
            }
    }

    RayHit seen(const Ray& ray, const RayMesh::Hit& hit) const {
        const auto& corners = mNormals[hit.triangle];
        const std::array<double, 3> weights{1 - hit.u - hit.v, hit.u, hit.v};
        const Vec3d position = ray.origin + ray.direction * hit.distance;
        const Vec3d flat = facing(areaVector(mMesh.triangles()[hit.triangle]), ray.direction);
        Vec3d normal, lift;
        for (size_t k = 0; k < 3; ++k) {
            Vec3d n;
            for (int axis = 0; axis < 3; ++axis) n[axis] = static_cast<double>(corners[k][axis]);
            if (dot(n, flat) < 0) n = -n;
            normal += n * weights[k];
            // Lift to the plane of the vertex if that is above (Hanika, Hacking the Shadow Terminator, Ray Tracing Gems
            // II).
            const Vec3d from = mMesh.vertices()[mMesh.triangles()[hit.triangle].c[k]];
            lift -= n * (weights[k] * std::min(0.0, dot(position - from, n)));
        }
        normal = facing(normal, ray.direction);
        return {.distance = hit.distance, .normal = length(normal) > 0.5 ? normal : flat, .lift = length(lift)};
    }

    RayMesh mMesh;
    std::vector<std::array<Vec3f, 3>> mNormals; ///< By triangle and corner.
};

/// The zero set of the spline through a level set. A ray's hit on OpenVDB's mesh of the level set is moved onto the
/// spline.
class LevelSetSurface final : public Surface::Model {
  public:
    LevelSetSurface(Faces faces, double voxel, ScalarField distance)
        : mMesh(std::move(faces.vertices), std::move(faces.triangles)), mVoxel(voxel), mDistance(std::move(distance)) {}

    double rayOffset() const override { return mVoxel; }

    void occluded(std::span<const Ray> rays, double, std::span<uint8_t> flags) const override {
        mMesh.occluded(rays, flags);
    }

    void intersect(std::span<const Ray> rays, double, std::span<RayHit> hits) const override {
        std::vector<std::optional<RayMesh::Hit>> onMesh(rays.size());
        mMesh.hits(rays, onMesh);
        std::vector<size_t> found;
        for (size_t k = 0; k < rays.size(); ++k) {
            hits[k] = {};
            if (!onMesh[k]) continue;
            hits[k].distance = onMesh[k]->distance;
            found.push_back(k);
        }
        for (size_t begin = 0; begin < found.size(); begin += kBatch)
            refine(rays, hits, std::span(found).subspan(begin, std::min<size_t>(kBatch, found.size() - begin)));
    }

  private:
    /// Newton's method along the ray. It starts on the mesh, which is within a small fraction of a voxel of the spline.
    /// Hits of grazing rays are left unchanged.
    void refine(std::span<const Ray> rays, std::span<RayHit> hits, std::span<const size_t> found) const {
        constexpr int kNewtonSteps = 2;
        PointBatch points;
        JetBatch<double, 1> jets;
        for (int step = 0; step <= kNewtonSteps; ++step) {
            points.size = 0;
            for (const size_t i : found) points.push(rays[i].origin + rays[i].direction * hits[i].distance);
            mDistance.eval(points, jets);
            bool converged = true;
            for (int k = 0; k < points.size; ++k) {
                const size_t i = found[static_cast<size_t>(k)];
                const auto jet = jets[k];
                hits[i].normal = facing(jet.gradient, rays[i].direction);
                const double by = jet.value / dot(jet.gradient, rays[i].direction);
                if (step == kNewtonSteps || !(std::abs(by) < 0.5 * mVoxel)) continue;
                hits[i].distance -= by;
                converged = converged && std::abs(by) < 1e-3 * mVoxel;
            }
            if (converged) return; // this close, the normal is accurate enough
        }
    }

    RayMesh mMesh;
    double mVoxel;
    ScalarField mDistance;
};

} // namespace

std::shared_ptr<const Surface::Model> meshModel(const Mesh& mesh) {
    return std::make_shared<MeshSurface>(facesOf(mesh));
}

std::shared_ptr<const Surface::Model> gridModel(const openvdb::FloatGrid& grid, double voxel, const Vec3d& origin) {
    return std::make_shared<MeshSurface>(facesOf(grid, [&](const Vec3d& ijk) { return origin + ijk * voxel; }));
}

std::shared_ptr<const Surface::Model> levelSetModel(const LevelSet& levelSet, const ScalarField& distance) {
    Faces faces = facesOf(*levelSet.grid, [&](const Vec3d& ijk) {
        const auto world = levelSet.grid->indexToWorld(openvdb::Vec3d(ijk[0], ijk[1], ijk[2]));
        return Vec3d{{world[0], world[1], world[2]}};
    });
    return std::make_shared<LevelSetSurface>(std::move(faces), levelSet.voxelSize(), distance);
}

} // namespace curlew
