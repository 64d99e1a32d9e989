// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/render/Surface.h"
#include "curlew/vdb/GridTypes.h"

namespace curlew {

/// The geometry of a surface. Immutable, safe to share between threads.
class Surface::Model {
  public:
    Model() = default;
    Model(const Model&) = delete;
    Model& operator=(const Model&) = delete;
    virtual ~Model() = default;
    virtual void intersect(std::span<const Ray> rays, double resolution, std::span<RayHit> hits) const = 0;
    /// Computes whether each ray hits anything.
    virtual void occluded(std::span<const Ray> rays, double resolution, std::span<uint8_t> flags) const {
        std::vector<RayHit> hits(rays.size());
        intersect(rays, resolution, hits);
        for (size_t k = 0; k < rays.size(); ++k) flags[k] = hits[k].found() ? 1 : 0;
    }
    virtual double rayOffset() const { return 0; }
};

std::shared_ptr<const Surface::Model> meshModel(const Mesh& mesh);
/// Returns a model of the zero set of a grid, by OpenVDB's mesh of it. Sample (i, j, k) is at origin + voxel (i, j, k).
/// The grid's transform is ignored, because OpenVDB's transforms do not support voxels below about 1e-5.
std::shared_ptr<const Surface::Model> gridModel(const openvdb::FloatGrid& grid, double voxel, const Vec3d& origin);
/// `distance`: the spline through the level set.
std::shared_ptr<const Surface::Model> levelSetModel(const LevelSet& levelSet, const ScalarField& distance);

/// Returns the unit normal that faces against the ray's direction.
inline Vec3d facing(const Vec3d& gradient, const Vec3d& direction) {
    const double size = length(gradient);
    const Vec3d normal = size > 0 ? gradient * (1 / size) : gradient;
    return dot(normal, direction) > 0 ? -normal : normal;
}

} // namespace curlew
