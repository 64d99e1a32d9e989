// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/LevelSet.h"

#include "BandSize.h"
#include "Enclosed.h"
#include "SolidChecks.h"
#include "curlew/vdb/MeshSolid.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/format.h>
#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/FastSweeping.h>

#include <algorithm>
#include <cmath>

namespace curlew {

double LevelSet::voxelSize() const { return grid->voxelSize()[0]; }

double LevelSet::halfWidth() const { return static_cast<double>(grid->background()) / voxelSize(); }

LevelSet meshToLevelSet(std::shared_ptr<const Mesh> mesh, SolidOptions options, const Monitor& monitor) {
    options.measureParts = false;
    return solidOf(std::move(mesh), options, monitor).levelSet;
}

namespace {

openvdb::FloatGrid::Ptr withBackground(const openvdb::FloatGrid& grid, float background) {
    auto copy = grid.deepCopy();
    openvdb::tools::changeLevelSetBackground(copy->tree(), background);
    return copy;
}

} // namespace

LevelSet levelSetOf(const openvdb::GridBase::ConstPtr& grid) {
    const auto floats = openvdb::GridBase::grid<openvdb::FloatGrid>(grid);
    if (!floats)
        throw ValueError(
            fmt::format("grid '{}' is a {} grid; a level set has float values", grid->getName(), grid->valueType()));
    if (floats->getGridClass() != openvdb::GRID_LEVEL_SET)
        throw ValueError(fmt::format("grid '{}' is not a level set; its class is '{}'", grid->getName(),
                                     openvdb::GridBase::gridClassToString(grid->getGridClass())));
    const auto voxel = floats->voxelSize();
    if (!floats->hasUniformVoxels() || !(voxel[0] > 0) || !floats->transform().isLinear())
        throw ValueError(fmt::format("level set '{}' must have cubic voxels", grid->getName()));
    if (!(floats->background() > 0) || !std::isfinite(floats->background()))
        throw ValueError(fmt::format("level set '{}' has background {}; it must be positive", grid->getName(),
                                     floats->background()));
    float greatest = 0;
    for (auto leaf = floats->tree().cbeginLeaf(); leaf; ++leaf)
        for (auto value = leaf->cbeginValueOn(); value; ++value) {
            if (!std::isfinite(*value))
                throw ValueError(fmt::format("level set '{}' has values that are not finite", grid->getName()));
            greatest = std::max(greatest, std::abs(*value));
        }
    if (!enclosesSomething(*floats)) throw ValueError(fmt::format("level set '{}' encloses nothing", grid->getName()));
    const auto most = greatest + static_cast<float>(voxel[0]);
    if (greatest > 0 && floats->background() > std::max(2 * greatest, most))
        return {withBackground(*floats, most), nullptr};
    return {floats, nullptr};
}

LevelSet widened(const LevelSet& levelSet, double halfWidth, const Monitor& monitor) {
    if (levelSet.halfWidth() >= halfWidth - 1e-3) return levelSet;
    const double voxel = levelSet.voxelSize();
    requireBand(levelSet.mesh ? extentOf(*levelSet.mesh, voxel) : extentOf(levelSet), halfWidth, voxel);
    if (levelSet.mesh)
        return solidOf(levelSet.mesh,
                       {.voxel = voxel,
                        .halfWidth = halfWidth,
                        .thickness = thicknessOf(*levelSet.grid),
                        .measureParts = false},
                       monitor)
            .levelSet;
    const int dilation = static_cast<int>(std::ceil(halfWidth - levelSet.halfWidth()));
    // Extends the band outwards from the old one, which stays unchanged.
    auto grid = openvdb::tools::dilateSdf(*levelSet.grid, dilation, openvdb::tools::NN_FACE, 1);
    const auto background = static_cast<float>(halfWidth * voxel);
    openvdb::tools::changeLevelSetBackground(grid->tree(), background);
    return {grid, nullptr};
}

} // namespace curlew
