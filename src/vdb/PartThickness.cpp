// SPDX-License-Identifier: Apache-2.0
#include "PartThickness.h"

#include "BandSize.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/MeshSolid.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/RayMesh.h"

#include <openvdb/tools/Interpolation.h>

#include <algorithm>
#include <cmath>

namespace curlew {

namespace {

using openvdb::FloatGrid;
using Sampler = openvdb::tools::GridSampler<FloatGrid::ConstAccessor, openvdb::tools::BoxSampler>;

constexpr double kSamples = 20000;
constexpr double kMaxPerEdge = 100;     ///< Samples of one triangle along each edge.
constexpr double kStart = 1e-3;         ///< Where a ray begins below the surface, in voxels.
constexpr double kOpposite = -0.3;      ///< Cosine between the normals of a face and of the face where a ray leaves.
constexpr double kThinTolerance = 1e-4; ///< Relative, so that voxels of the recommended size suffice.
constexpr int kMaxFaces = 8;            ///< Faces that a ray passes before it is given up.

/// The surface below one position: its area, and the thickness there, which is infinite if it is not thin.
struct Sample {
    double area = 0, thickness = std::numeric_limits<double>::infinity();
};

/// The samples of some triangles.
struct RaySamples {
    std::vector<Sample> all;
    RaySamples& operator+=(const RaySamples& o) {
        all.insert(all.end(), o.all.begin(), o.all.end());
        return *this;
    }
};

class Prober {
  public:
    Prober(const RayMesh& mesh, const FloatGrid& grid)
        : mMesh(mesh),
          mVoxel(grid.voxelSize()[0]),
          mAccess(grid.getConstAccessor()),
          mDistance(mAccess, grid.transform()) {}

    /// Adds the samples of a triangle: the centroids of m² equal triangles.
    void addSamples(uint32_t face, int m, std::vector<Sample>& samples) const {
        const auto& corners = mMesh.triangles()[face];
        const Vec3d a = mMesh.vertices()[corners[0]], u = (mMesh.vertices()[corners[1]] - a) * (1.0 / m),
                    v = (mMesh.vertices()[corners[2]] - a) * (1.0 / m);
        const Vec3d normal = mMesh.normal(face);
        const double area = 0.5 * length(cross(u, v));
        if (!(area > 0)) return;
        for (int i = 0; i < m; ++i)
            for (int j = 0; i + j < m; ++j) {
                const Vec3d corner = a + u * i + v * j;
                add(corner + (u + v) * (1.0 / 3), normal, area, samples);
                if (i + j + 1 < m) add(corner + (u + v) * (2.0 / 3), normal, area, samples);
            }
    }

  private:
    double distance(const Vec3d& p) const {
        return static_cast<double>(mDistance.wsSample(openvdb::Vec3d(p[0], p[1], p[2])));
    }
    /// Returns whether a position on a face is inside the solid, so that the face bounds nothing there.
    bool buried(const Vec3d& p) const { return distance(p) < -0.5 * mVoxel; }

    void add(const Vec3d& p, const Vec3d& normal, double area, std::vector<Sample>& samples) const {
        if (buried(p)) return;
        // Either side may be the inside, since the faces need not be oriented.
        const bool outward = distance(p + normal * mVoxel) >= distance(p - normal * mVoxel);
        samples.push_back({area, thicknessAt(p, normal * (outward ? -1.0 : 1.0), normal)});
    }

    double thicknessAt(const Vec3d& p, const Vec3d& inward, const Vec3d& normal) const {
        const double enough = kThinVoxels * mVoxel * (1 - kThinTolerance);
        double from = kStart * mVoxel;
        for (int k = 0; k < kMaxFaces; ++k) {
            const auto hit = mMesh.hit({p + inward * from, inward});
            if (!hit || from + hit->distance >= enough) break;
            const double thickness = from + hit->distance;
            if (dot(mMesh.normal(hit->triangle), normal) < kOpposite && !buried(p + inward * thickness))
                return thickness;
            from = thickness + kStart * mVoxel;
        }
        return std::numeric_limits<double>::infinity();
    }

    const RayMesh& mMesh;
    double mVoxel;
    FloatGrid::ConstAccessor mAccess;
    Sampler mDistance;
};

/// Returns the thickness below which a twentieth of the area of the thin samples lies.
double thinnestOf(std::vector<Sample> thin) {
    constexpr double kLeftOut = 0.05;
    std::sort(thin.begin(), thin.end(), [](const Sample& a, const Sample& b) { return a.thickness < b.thickness; });
    double area = 0, before = 0;
    for (const Sample& sample : thin) area += sample.area;
    for (const Sample& sample : thin)
        if ((before += sample.area) >= kLeftOut * area) return sample.thickness;
    return 0;
}

} // namespace

PartThickness partThickness(const Mesh& mesh, const FloatGrid& grid, const Monitor& monitor) {
    const RayMesh rays(mesh, monitor);
    const size_t faces = rays.triangles().size(), stride = std::max<size_t>(1, faces / static_cast<size_t>(kSamples));
    const double perArea = kSamples / areaOf(mesh);
    const auto perEdge = [&](uint32_t face) {
        const auto& t = rays.triangles()[face];
        const Vec3d a = rays.vertices()[t[0]];
        const double area = 0.5 * length(cross(rays.vertices()[t[1]] - a, rays.vertices()[t[2]] - a));
        return static_cast<int>(std::clamp(std::sqrt(area * perArea), 1.0, kMaxPerEdge));
    };
    const RaySamples samples = parallelSum((faces + stride - 1) / stride, 256,
                                           [&](size_t begin, size_t end) {
                                               const Prober prober(rays, grid);
                                               RaySamples own;
                                               for (size_t k = begin; k < end; ++k) {
                                                   const auto face = static_cast<uint32_t>(k * stride);
                                                   prober.addSamples(face, perEdge(face), own.all);
                                               }
                                               return own;
                                           },
                                           monitor);
    PartThickness result;
    double area = 0;
    std::vector<Sample> thin;
    for (const Sample& sample : samples.all) {
        area += sample.area;
        if (sample.thickness < grid.voxelSize()[0]) result.below += sample.area;
        if (!std::isfinite(sample.thickness)) continue;
        result.thin += sample.area;
        thin.push_back(sample);
    }
    if (!(area > 0)) return {};
    result.thin /= area;
    result.below /= area;
    result.thinnest = thinnestOf(std::move(thin));
    return result;
}

} // namespace curlew
