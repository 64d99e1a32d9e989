// SPDX-License-Identifier: Apache-2.0
#include "WallSolids.h"

#include "curlew/vdb/Openvdb.h"

#include <algorithm>
#include <cmath>

namespace curlew::app {

namespace {

/// The solids of the previous frame, by their meshes.
struct Known {
    std::vector<std::pair<openvdb::GridBase::ConstPtr, std::shared_ptr<const SolidDistance>>> solids;
};

/// Returns up to about 64 voxels next to the surface, evenly spread.
std::vector<openvdb::Coord> samplesOf(const openvdb::FloatGrid& grid) {
    constexpr size_t kSamples = 64;
    std::vector<openvdb::Coord> voxels, samples;
    const auto near = static_cast<float>(0.5 * grid.voxelSize()[0]);
    for (auto value = grid.cbeginValueOn(); value; ++value)
        if (std::abs(*value) < near) voxels.push_back(value.getCoord());
    const size_t stride = std::max<size_t>(1, voxels.size() / kSamples);
    for (size_t k = 0; k < voxels.size(); k += stride) samples.push_back(voxels[k]);
    return samples;
}

/// Returns whether the wall is the union of level sets with these surfaces: their samples are distances to it.
bool isUnionOf(const Sdf& wall, const std::vector<GridValue>& levelSets) {
    constexpr double kTolerance = 0.25; // in voxels
    for (const GridValue& value : levelSets) {
        const LevelSet levelSet = levelSetOf(value.grid);
        const auto samples = samplesOf(*levelSet.grid);
        size_t off = 0;
        for (const openvdb::Coord& voxel : samples) {
            const openvdb::Vec3d p = levelSet.grid->indexToWorld(voxel);
            const double excess = wall.distance.at<0>({{p[0], p[1], p[2]}}).value -
                                  static_cast<double>(levelSet.grid->tree().getValue(voxel));
            // A union may be deeper than one of its parts.
            off += (levelSets.size() > 1 ? excess : std::abs(excess)) > kTolerance * levelSet.voxelSize();
        }
        if (10 * off > samples.size()) return false;
    }
    return true;
}

} // namespace

std::optional<WallSolids> WallSolids::of(const Context& c, const char* input) {
    const auto wall = c.flow(input).domain().wall;
    if (!wall || wall->side == Side::both) return {};
    for (const auto& levelSets : c.levelSetsBehind(input)) {
        const bool meshes = std::all_of(levelSets.begin(), levelSets.end(),
                                        [](const GridValue& value) { return value.mesh != nullptr; });
        if (!meshes || !isUnionOf(wall->sdf, levelSets)) continue;
        const auto before = std::static_pointer_cast<Known>(c.memory().object);
        auto known = std::make_shared<Known>();
        WallSolids found;
        found.mSide = wall->side;
        for (const GridValue& value : levelSets) {
            const auto levelSet = openvdb::GridBase::grid<openvdb::FloatGrid>(value.grid);
            std::shared_ptr<const SolidDistance> solid;
            if (before)
                for (const auto& [grid, made] : before->solids)
                    if (grid == value.grid) solid = made;
            try {
                if (!solid)
                    solid = std::make_shared<const SolidDistance>(LevelSet{levelSet, value.mesh},
                                                                  c.follow("preparing the wall's mesh"));
            } catch (const ResourceError& error) {
                c.warn(fmt::format("points are not judged by the wall's mesh: {}", error.what()));
                return {};
            }
            known->solids.emplace_back(value.grid, solid);
            found.mSolids.push_back(std::move(solid));
            found.mVoxel = std::max(found.mVoxel, levelSet->voxelSize()[0]);
        }
        c.memory().object = known;
        return found;
    }
    return {};
}

WrongSide WallSolids::wrongSide(std::span<const double> x, std::span<const double> y, std::span<const double> z,
                                const Monitor& monitor) const {
    std::vector<const SolidDistance*> solids;
    for (const auto& solid : mSolids) solids.push_back(solid.get());
    return wrongSideOf(solids, mSide, x, y, z, monitor);
}

} // namespace curlew::app
