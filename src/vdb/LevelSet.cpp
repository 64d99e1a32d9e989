// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/LevelSet.h"

#include "BandSize.h"
#include "DenseBox.h"
#include "Enclosed.h"
#include "LevelSetScale.h"
#include "SolidChecks.h"
#include "curlew/vdb/MeshSolid.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/format.h>
#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/FastSweeping.h>
#include <openvdb/tools/Prune.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace curlew {

double LevelSet::voxelSize() const { return grid->voxelSize()[0]; }

double LevelSet::halfWidth() const { return static_cast<double>(grid->background()) / voxelSize(); }

LevelSet meshToLevelSet(std::shared_ptr<const Mesh> mesh, SolidOptions options, const Monitor& monitor) {
    options.measureParts = false;
    return solidOf(std::move(mesh), options, monitor).levelSet;
}

namespace {

using openvdb::FloatGrid;

/// Returns the three greatest absolute values of active voxels and tiles, each less than the one before; 0 if there are
/// fewer.
std::array<float, 3> greatestOf(const FloatGrid& grid) {
    std::array<float, 3> greatest{};
    for (auto value = grid.cbeginValueOn(); value; ++value) {
        if (!std::isfinite(*value))
            throw ValueError(fmt::format("level set '{}' has values that are not finite", grid.getName()));
        float size = std::abs(*value);
        for (float& one : greatest) {
            if (size == one) break;
            if (size > one) std::swap(size, one);
        }
    }
    return greatest;
}

/// Returns a copy with another background, in which voxels with absolute values from `limit` on are not active.
FloatGrid::Ptr withBackground(const FloatGrid& grid, float background, float limit) {
    auto copy = grid.deepCopy();
    for (auto value = copy->beginValueOn(); value; ++value)
        if (!(std::abs(*value) < limit)) value.setActiveState(false);
    openvdb::tools::changeLevelSetBackground(copy->tree(), background);
    openvdb::tools::pruneLevelSet(copy->tree());
    return copy;
}

/// Extends a band outwards from the old one, which stays unchanged.
FloatGrid::Ptr dilated(const FloatGrid& grid, double from, double halfWidth) {
    const auto voxel = static_cast<float>(grid.voxelSize()[0]);
    const auto inVoxels = grid.deepCopy(); // OpenVDB takes distances from 1000 on for unknown
    scaleDistances(*inVoxels, 1 / voxel);
    inVoxels->setTransform(openvdb::math::Transform::createLinearTransform(1));
    // Across faces only, it would reach as far as this only along the axes, and 0.6 times as far along diagonals.
    auto wide = openvdb::tools::dilateSdf(*inVoxels, static_cast<int>(std::ceil(halfWidth - from)),
                                          openvdb::tools::NN_FACE_EDGE_VERTEX, 1);
    const auto most = static_cast<float>(halfWidth);
    for (auto leaf = wide->tree().beginLeaf(); leaf; ++leaf)
        for (auto value = leaf->beginValueOn(); value; ++value)
            if (const float d = *value; !(std::abs(d) < most))
                leaf->setValueOff(value.pos(), std::copysign(wide->background(), d));
    openvdb::tools::changeLevelSetBackground(wide->tree(), most);
    scaleDistances(*wide, voxel);
    auto to = wide->getAccessor();
    for (auto value = grid.cbeginValueOn(); value; ++value)
        if (value.isVoxelValue()) to.setValue(value.getCoord(), *value); // without the rounding of the scales
    wide->setTransform(grid.transform().copy());
    openvdb::tools::pruneLevelSet(wide->tree());
    return wide;
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
    if (!hasCubicVoxels(*floats))
        throw ValueError(fmt::format("level set '{}' must have cubic voxels", grid->getName()));
    if (!(floats->background() > 0) || !std::isfinite(floats->background()))
        throw ValueError(fmt::format("level set '{}' has background {}; it must be positive", grid->getName(),
                                     floats->background()));
    const std::array<float, 3> greatest = greatestOf(*floats);
    if (!enclosesSomething(*floats)) throw ValueError(fmt::format("level set '{}' encloses nothing", grid->getName()));
    constexpr float kMarker = 4, kForeign = 2; // times the greatest distance
    const auto size = static_cast<float>(floats->voxelSize()[0]);
    size_t markers = 0; // one outside and another inside, at most
    for (size_t k = 0; k + 1 < greatest.size(); ++k)
        if (const float next = greatest[k + 1]; next > 0 && greatest[k] > std::max(kMarker * next, next + 2 * size))
            markers = k + 1;
    const float distance = greatest[markers];
    const bool foreign = distance > 0 && floats->background() > std::max(kForeign * distance, distance + size);
    if (markers == 0 && !foreign) {
        const float background = floats->background();
        if (greatest[0] != background || greatest[1] == 0) return {floats, nullptr};
        return {withBackground(*floats, background, background), nullptr};
    }
    const float limit = markers > 0 ? greatest[markers - 1] : std::numeric_limits<float>::infinity();
    return {withBackground(*floats, distance + size, limit), nullptr};
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
    return {dilated(*levelSet.grid, levelSet.halfWidth(), halfWidth), nullptr};
}

} // namespace curlew
