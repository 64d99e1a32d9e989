// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/render/Surface.h"

#include <cstdint>
#include <optional>

namespace curlew {

/// Triangles for ray tracing with Embree (3 or 4; no other file uses it). Rays hit neighbouring triangles without gaps.
/// Embree finds the first triangle in float, with the mesh's box moved to the origin and scaled to 1; the hit is then
/// computed here in double. All machines use the same instruction set (AVX2). Immutable, safe to share between threads.
class RayMesh {
  public:
    /// Throws ValueError if there are no triangles or the box has no extent, ResourceError if Embree runs out of
    /// memory.
    RayMesh(std::vector<Vec3d> vertices, std::vector<Vec<uint32_t, 3>> triangles);
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
    /// Returns whether a ray hits any triangle.
    bool occluded(const Ray& ray) const;

    const std::vector<Vec3d>& vertices() const { return mVertices; }
    const std::vector<Vec<uint32_t, 3>>& triangles() const { return mTriangles; }
    const Box& box() const { return mBox; }

  private:
    std::vector<Vec3d> mVertices;
    std::vector<Vec<uint32_t, 3>> mTriangles;
    Box mBox;
    Vec3d mCenter;
    double mScale = 1; ///< From world units to Embree's.
    struct Scene;
    std::unique_ptr<Scene> mScene;
};

} // namespace curlew
