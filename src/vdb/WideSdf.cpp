// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/WideSdf.h"

#include "BandSize.h"
#include "SolidChecks.h"
#include "SplineField.h"
#include "SplineRefinement.h"
#include "curlew/base/Error.h"
#include "curlew/vdb/LevelSetMesh.h"
#include "curlew/vdb/Openvdb.h"

#include <openvdb/tools/ChangeBackground.h>

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
          mMesh(std::make_shared<Mesh>(levelSet.mesh ? *levelSet.mesh : levelSetToMesh(levelSet))) {
        // In voxels, because new level sets have no origin and no axes but those of the coordinates.
        for (auto& p : mMesh->points) p = mTransform->worldToIndex(p);
    }

    /// Returns one with voxels `times` as large; nullopt if they do not resolve the surface.
    std::optional<LevelSet> operator()(int times, double halfWidth, const Monitor& monitor) const {
        const SolidOptions options{.voxel = double(times), .halfWidth = halfWidth, .thickness = mThickness};
        requireBand(extentOf(*mMesh, times), halfWidth, times * mTransform->voxelSize()[0]);
        try {
            const auto grid = meshToLevelSet(mMesh, options, monitor).grid->deepCopy();
            const auto unit = static_cast<float>(mTransform->voxelSize()[0]);
            const float background = unit * grid->background();
            for (auto value = grid->beginValueOn(); value; ++value) value.setValue(unit * *value);
            openvdb::tools::changeLevelSetBackground(grid->tree(), background);
            grid->setTransform(mTransform->copy());
            grid->transform().preScale(times);
            return LevelSet{grid, nullptr};
        } catch (const ValueError&) {
            return {};
        }
    }

  private:
    openvdb::math::Transform::Ptr mTransform;
    double mThickness; // voxels
    std::shared_ptr<Mesh> mMesh;
};

} // namespace

Sdf sdfUpTo(const LevelSet& levelSet, double distance, const Monitor& monitor) {
    const auto halfWidthAt = [&](int times) { return distance / (times * levelSet.voxelSize()) + kSplineSupport; };
    if (halfWidthAt(1) <= std::max(kOneBand, levelSet.halfWidth()))
        return sdfOf(widened(levelSet, halfWidthAt(1), monitor));
    const LargerVoxels larger(levelSet);
    constexpr int kRatio = SplineRefinement::kRatio;
    std::vector<LevelSet> bands{widened(levelSet, kFineBand, monitor)};
    for (int times = kRatio;; times *= kRatio) {
        const bool last = halfWidthAt(times) <= kOneBand;
        if (auto band = larger(times, last ? halfWidthAt(times) : kFineBand, monitor)) {
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
