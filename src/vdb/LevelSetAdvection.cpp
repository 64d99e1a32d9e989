// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/LevelSetAdvection.h"

#include "BackwardMap.h"
#include "Redistance.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace curlew {

namespace {

constexpr double kSourceBand = 6; ///< Half width of the original's band, voxels. Samples beyond it do not affect the
                                  ///< spline at the surface.

Vec3d toVec(const openvdb::Vec3d& v) { return {{v[0], v[1], v[2]}}; }
openvdb::Vec3d toOpenVdb(const Vec3d& v) { return {v[0], v[1], v[2]}; }

/// Returns points all over the surface of a level set, a few per voxel, in world units.
std::vector<Vec3d> surfaceOf(const openvdb::FloatGrid& grid) {
    std::vector<Vec3d> points;
    const openvdb::tree::ValueAccessor<const openvdb::FloatTree> samples(grid.tree());
    for (auto value = grid.tree().cbeginValueOn(); value; ++value) {
        const openvdb::Coord voxel = value.getCoord();
        for (int axis = 0; axis < 3; ++axis) {
            openvdb::Coord next = voxel;
            ++next[axis];
            const auto a = static_cast<double>(*value), b = static_cast<double>(samples.getValue(next));
            if ((a < 0) == (b < 0)) continue;
            openvdb::Vec3d p = voxel.asVec3d();
            p[axis] += a / (a - b);
            points.push_back(toVec(grid.indexToWorld(p)));
        }
    }
    return points;
}

} // namespace

class LevelSetSequence::Implementation {
  public:
    Implementation(const LevelSet& levelSet, FlowInTime flow, double begin, const LevelSetSequenceOptions& options,
                   const Monitor& monitor)
        : mMap(std::move(flow), forVoxels(options.map, levelSet.voxelSize())),
          mHorizon(options.horizon),
          mHalfWidth(levelSet.halfWidth()),
          mVoxelSize(levelSet.voxelSize()),
          mTime(begin) {
        if (!(mHorizon > 0)) throw ValueError(fmt::format("horizon {} s must be positive", mHorizon));
        mMap.steps(begin, begin); // throws if the time is not finite
        setOriginal(widened(levelSet, kSourceBand, monitor));
    }

    double time() const { return mTime; }

    AdvectedLevelSet advance(double time, const Monitor& monitor) {
        AdvectedLevelSet result;
        std::vector<Vec3d> surface = mSurface;
        mMap.carry(surface, mTime, time, monitor.quiet());
        std::vector<openvdb::Vec3d> seeds;
        seeds.reserve(surface.size());
        for (const Vec3d& p : surface) seeds.push_back(mTemplate->worldToIndex(toOpenVdb(p)));

        auto stored = std::make_unique<BackwardMap>(mSource->distance);
        BackwardMap& map = *stored;
        bool first = true;
        map.follow(
            seeds,
            [&](const std::vector<openvdb::Coord>& voxels) {
                const Monitor part = std::exchange(first, false) ? monitor : monitor.quiet();
                return originsOf(voxels, time, result, part);
            },
            monitor);
        result.traced = map.size();
        const auto crossings = map.crossings(monitor.quiet());
        if (crossings.empty())
            throw ValueError(fmt::format(
                "at {:.6g} s, the level set is thinner than voxels of {:.6g} everywhere; use smaller voxels", time,
                mVoxelSize));
        const bool restart = std::abs(time - mBegan) >= mHorizon * (1 - 1e-9);
        const ClosestPoints closest(map, crossings, restart ? std::max(mHalfWidth, kSourceBand) : mHalfWidth,
                                    monitor.quiet());
        result.unconverged = closest.unconverged();
        const auto grid = gridOf(closest, mHalfWidth);
        measureShift(*grid, crossings, result);
        result.levelSet = {grid, nullptr};

        mSurface.clear();
        for (const auto& crossing : crossings) mSurface.push_back(toVec(mTemplate->indexToWorld(crossing.position())));
        mTime = time;
        if (mMap.steady()) mStored = std::move(stored);
        result.restarted = restart;
        if (restart) {
            mStored.reset();
            mBegan = time;
            mSource = sdfOf({gridOf(closest, std::max(mHalfWidth, kSourceBand)), nullptr});
        }
        return result;
    }

  private:
    void setOriginal(const LevelSet& original) {
        mTemplate = original.grid;
        mSource = sdfOf(original);
        mBegan = mTime;
        mSurface = surfaceOf(*original.grid);
    }

    openvdb::FloatGrid::Ptr gridOf(const ClosestPoints& closest, double halfWidth) const {
        auto grid = closest.grid(halfWidth, mVoxelSize);
        grid->setTransform(mTemplate->transform().copy());
        grid->insertMeta(*mTemplate);
        grid->setGridClass(openvdb::GRID_LEVEL_SET);
        return grid;
    }

    /// Returns the positions of the matter at these voxels at the time of the original.
    std::vector<Vec3d> originsOf(const std::vector<openvdb::Coord>& voxels, double time, AdvectedLevelSet& result,
                                 const Monitor& monitor) const {
        std::vector<Vec3d> origins(voxels.size());
        std::vector<Vec3d> whole, rest;
        std::vector<size_t> wholeOf, restOf;
        for (size_t n = 0; n < voxels.size(); ++n) {
            const int32_t stored = mStored ? mStored->index().getValue(voxels[n]) : -1;
            if (stored >= 0) {
                restOf.push_back(n);
                rest.push_back(mStored->origin(static_cast<size_t>(stored)));
            } else {
                wholeOf.push_back(n);
                whole.push_back(toVec(mTemplate->indexToWorld(voxels[n])));
            }
        }
        for (const FlowMapResult& traced :
             {mMap.carry(rest, time, mTime, monitor.quiet()), mMap.carry(whole, time, mBegan, monitor)}) {
            result.stalled += traced.stalled;
            result.overrun += traced.overrun;
        }
        for (size_t n = 0; n < rest.size(); ++n) origins[restOf[n]] = rest[n];
        for (size_t n = 0; n < whole.size(); ++n) origins[wholeOf[n]] = whole[n];
        return origins;
    }

    void measureShift(const openvdb::FloatGrid& grid, const std::vector<BackwardMap::Crossing>& crossings,
                      AdvectedLevelSet& result) const {
        const openvdb::tree::ValueAccessor<const openvdb::FloatTree> samples(grid.tree());
        double sum = 0;
        for (const auto& crossing : crossings) {
            openvdb::Coord next = crossing.voxel;
            ++next[crossing.axis];
            const auto a = static_cast<double>(samples.getValue(crossing.voxel)),
                       b = static_cast<double>(samples.getValue(next));
            const double shift = std::abs(a + (b - a) * crossing.fraction) / mVoxelSize;
            sum += shift;
            result.greatestShift = std::max(result.greatestShift, shift);
        }
        result.meanShift = sum / static_cast<double>(crossings.size());
    }

    FlowMap mMap;
    double mHorizon, mHalfWidth, mVoxelSize;
    openvdb::FloatGrid::ConstPtr mTemplate; // transform and metadata
    std::optional<Sdf> mSource;             // φ₀
    double mBegan = 0;                      // time of φ₀
    double mTime = 0;
    std::vector<Vec3d> mSurface;          // points of the surface at mTime
    std::unique_ptr<BackwardMap> mStored; // in a steady flow: from mTime to mBegan
};

LevelSetSequence::LevelSetSequence(const LevelSet& levelSet, FlowInTime flow, double begin,
                                   const LevelSetSequenceOptions& options, const Monitor& monitor)
    : mImplementation(std::make_unique<Implementation>(levelSet, std::move(flow), begin, options, monitor)) {}
LevelSetSequence::~LevelSetSequence() = default;
LevelSetSequence::LevelSetSequence(LevelSetSequence&&) noexcept = default;
LevelSetSequence& LevelSetSequence::operator=(LevelSetSequence&&) noexcept = default;

double LevelSetSequence::time() const { return mImplementation->time(); }

AdvectedLevelSet LevelSetSequence::advance(double time, const Monitor& monitor) {
    return mImplementation->advance(time, monitor);
}

AdvectedLevelSet advectLevelSet(const LevelSet& levelSet, const FlowInTime& flow, double begin, double time,
                                const FlowMapOptions& options, const Monitor& monitor) {
    return LevelSetSequence(levelSet, flow, begin, {.map = options}, monitor.quiet()).advance(begin + time, monitor);
}

} // namespace curlew
