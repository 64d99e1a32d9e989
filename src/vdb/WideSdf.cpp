// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/WideSdf.h"

#include "BandSize.h"
#include "LevelSetScale.h"
#include "SolidChecks.h"
#include "SplineField.h"
#include "SplineRefinement.h"
#include "curlew/base/Error.h"
#include "curlew/vdb/LevelSetMesh.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>
#include <optional>
#include <vector>

namespace curlew {

namespace {

constexpr double kOneBand = 20;  ///< Half width in voxels up to which one band is made.
constexpr double kFineBand = 12; ///< Half width in voxels of a band that larger voxels continue.

/// Makes level sets of one surface with larger voxels on the same lattice.
class LargerVoxels {
  public:
    explicit LargerVoxels(const LevelSet& levelSet)
        : mTransform(levelSet.grid->transform().copy()),
          mThickness(thicknessOf(*levelSet.grid) / levelSet.voxelSize()),
          mMesh(std::make_shared<Mesh>(levelSet.mesh ? facesOf(*levelSet.mesh) : levelSetToMesh(levelSet))) {
        // In voxels, because new level sets have no origin and no axes but those of the coordinates.
        for (auto& p : mMesh->points) p = mTransform->worldToIndex(p);
    }

    /// Returns one with voxels `times` as large; nullopt if they do not resolve the surface.
    std::optional<LevelSet> operator()(int times, double halfWidth, const Monitor& monitor) const {
        const SolidOptions options{.voxel = double(times), .halfWidth = halfWidth, .thickness = mThickness};
        requireBand(extentOf(*mMesh, times), halfWidth, times * mTransform->voxelSize()[0]);
        try {
            const auto grid = meshToLevelSet(mMesh, options, monitor).grid->deepCopy();
            scaleDistances(*grid, static_cast<float>(mTransform->voxelSize()[0]));
            grid->removeMeta(kThickness); // in voxels
            grid->setTransform(mTransform->copy());
            grid->transform().preScale(times);
            return LevelSet{grid, nullptr};
        } catch (const ValueError&) {
            return {};
        }
    }

  private:
    static Mesh facesOf(const Mesh& mesh) {
        return {.points = mesh.points, .triangles = mesh.triangles, .quads = mesh.quads};
    }

    openvdb::math::Transform::Ptr mTransform;
    double mThickness; // voxels
    std::shared_ptr<Mesh> mMesh;
};

} // namespace

Sdf sdfUpTo(const LevelSet& levelSet, double distance, const Monitor& monitor) {
    const auto halfWidthAt = [&](int times) { return distance / (times * levelSet.voxelSize()) + kSplineSupport; };
    if (halfWidthAt(1) <= std::max(kOneBand, levelSet.halfWidth()))
        return sdfOf(widened(levelSet, halfWidthAt(1), monitor));
    constexpr int kRatio = SplineRefinement::kRatio;
    const LargerVoxels larger(levelSet);
    std::vector<LevelSet> bands{widened(levelSet, kFineBand, monitor)};
    for (int times = kRatio;; times *= kRatio) {
        constexpr double kOverlap = 2; // voxels; see sdfOfBands()
        const bool last = halfWidthAt(times) <= kOneBand;
        const double reachBefore = (bands.back().halfWidth() - kSplineSupport) / kRatio;
        const double least = reachBefore + kOverlap + kSplineSupport;
        if (auto band = larger(times, std::max(last ? halfWidthAt(times) : kFineBand, least), monitor)) {
            bands.push_back(std::move(*band));
            if (last) break;
            continue;
        }
        const int before = times / kRatio; // one wide band of these voxels, then
        if (before == 1)
            bands.back() = widened(levelSet, halfWidthAt(1), monitor);
        else
            bands.back() = larger(before, halfWidthAt(before), monitor).value();
        break;
    }
    return sdfOfBands(bands);
}

} // namespace curlew
