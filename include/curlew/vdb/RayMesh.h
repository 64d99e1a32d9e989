// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/field/Shapes.h"
#include "curlew/math/Ray.h"
#include "curlew/vdb/MeshFile.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace curlew {

/// Triangles for ray tracing and closest points with Embree (3 or 4; no other file uses it). Rays hit neighbouring
/// triangles without gaps. Embree finds the triangle in float, with the mesh's box moved to the origin and scaled to 1;
/// the hit is then computed here in double. All machines use the same instruction set (AVX2). Immutable, safe to share
/// between threads.
class RayMesh {
  public:
    /// Throws ValueError if there are no triangles or the box has no extent, ResourceError if Embree runs out of
    /// memory, Interrupted if the monitor cancels.
    RayMesh(std::vector<Vec3d> vertices, std::vector<Vec<uint32_t, 3>> triangles, const Monitor& monitor = {});
    /// The faces of a mesh. Each quad is split along the diagonal from its first to its third vertex.
    explicit RayMesh(const Mesh& mesh, const Monitor& monitor = {});
    ~RayMesh();
    RayMesh(const RayMesh&) = delete;
    RayMesh& operator=(const RayMesh&) = delete;

    struct Hit {
        double distance = 0; ///< From the ray's origin, world units.
        uint32_t triangle = 0;
        double u = 0, v = 0; ///< Barycentric weights of the triangle's second and third vertex.
    };
    /// Returns the first triangle that a ray hits; nullopt if there is none.
    std::optional<Hit> hit(const Ray& ray) const;
    /// The same for many rays, and as fast as Embree allows if neighbours in the array are similar.
    void hits(std::span<const Ray> rays, std::span<std::optional<Hit>> found) const;
    /// Computes whether each ray hits any triangle (1 or 0).
    void occluded(std::span<const Ray> rays, std::span<uint8_t> flags) const;
    /// Returns the distance from a position to the closest triangle, world units. Infinite if the position is not
    /// finite.
    double distanceTo(const Vec3d& position) const;
    /// Returns the normal of a triangle: a unit vector, on the side from which its vertices run counter-clockwise. Zero
    /// if the triangle has no area.
    Vec3d normal(uint32_t triangle) const;

    const std::vector<Vec3d>& vertices() const { return mVertices; }
    const std::vector<Vec<uint32_t, 3>>& triangles() const { return mTriangles; }
    const Box& box() const { return mBox; }

  private:
    /// Returns the hit of a ray on a triangle in double, given it in float, in Embree's units.
    Hit refined(const Ray& ray, uint32_t triangle, float distance, float u, float v) const;

    std::vector<Vec3d> mVertices;
    std::vector<Vec<uint32_t, 3>> mTriangles;
    Box mBox;
    Vec3d mCenter;
    double mScale = 1; ///< From world units to Embree's.
    struct Scene;
    std::unique_ptr<Scene> mScene;
};

} // namespace curlew
