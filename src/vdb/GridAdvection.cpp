// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/GridAdvection.h"

#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/format.h>
#include <openvdb/tools/Interpolation.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace curlew {

namespace {

using openvdb::Coord;

bool finite(float value) { return std::isfinite(value); }
bool finite(const openvdb::Vec3s& value) { return value.isFinite(); }

/// Calls visit(voxel, value) for every active voxel, including those stored as tiles.
template <class GridT, class Visit>
void visitActive(const GridT& grid, const Visit& visit) {
    for (auto value = grid.cbeginValueOn(); value; ++value) {
        if (!finite(*value)) throw ValueError(fmt::format("grid '{}' has values that are not finite", grid.getName()));
        openvdb::CoordBBox box;
        value.getBoundingBox(box);
        for (auto voxel = box.begin(); voxel; ++voxel) visit(*voxel, *value);
    }
}

double sizeOf(float value) { return std::abs(static_cast<double>(value)); }
double sizeOf(const openvdb::Vec3s& value) { return static_cast<double>(value.length()); }

/// Voxels to be evaluated, each once.
class Frontier {
  public:
    void addAround(const Coord& voxel, int before, int after) {
        for (int i = -before; i <= after; ++i)
            for (int j = -before; j <= after; ++j)
                for (int k = -before; k <= after; ++k) mAccess.setValueOn(voxel.offsetBy(i, j, k));
    }
    /// Returns the voxels that were added and have not been taken before.
    std::vector<Coord> take() {
        mWanted.topologyDifference(mTaken);
        mTaken.topologyUnion(mWanted);
        std::vector<Coord> voxels;
        for (auto voxel = mWanted.cbeginValueOn(); voxel; ++voxel) voxels.push_back(voxel.getCoord());
        mAccess.clear();
        mWanted.clear();
        return voxels;
    }

  private:
    openvdb::MaskTree mWanted, mTaken;
    openvdb::tree::ValueAccessor<openvdb::MaskTree> mAccess{mWanted};
};

template <class GridT>
class GridAdvector {
  public:
    using Value = typename GridT::ValueType;

    GridAdvector(const GridT& grid, const FlowInTime& flow, double begin, double time,
                 const GridAdvectionOptions& options, const Monitor& monitor)
        : mGrid(grid),
          mMap(flow, forVoxels(options.map, grid.voxelSize()[0])),
          mBegin(begin),
          mEnd(begin + time),
          mInterpolation(options.interpolation),
          mMonitor(monitor),
          mMoved(GridT::create(grid.background())) {
        mMoved->setTransform(grid.transform().copy());
        mMoved->insertMeta(grid);
        mMoved->setGridClass(grid.getGridClass());
    }

    AdvectedGrid run() {
        land();
        bool first = true;
        for (auto voxels = mFrontier.take(); !voxels.empty(); voxels = mFrontier.take())
            evaluate(voxels, std::exchange(first, false) ? mMonitor : mMonitor.quiet());
        return {mMoved, mTraced, mStalled, mOverrun};
    }

  private:
    /// Returns whether the coordinates of a position are those of a voxel, and not too large or NaN.
    static bool hasVoxel(const openvdb::Vec3d& position) { return position.lengthSqr() < 0x1p60; }

    /// Advects the active voxels and adds the voxels around their new positions to the frontier.
    void land() {
        requireMemory(static_cast<double>(mGrid.activeVoxelCount()) * (sizeof(Vec3d) + 2 * sizeof(Value)),
                      fmt::format("{} active voxels", mGrid.activeVoxelCount()), "choose larger voxels");
        std::vector<Vec3d> points;
        visitActive(mGrid, [&](const Coord& voxel, const Value& value) {
            const auto p = mGrid.indexToWorld(voxel);
            points.push_back({{p[0], p[1], p[2]}});
            mMax = std::max(mMax, sizeOf(value - mGrid.background()));
        });
        if (points.empty()) throw ValueError(fmt::format("grid '{}' has no active voxel", mGrid.getName()));
        mMap.carry(points, mBegin, mEnd, mMonitor.quiet());
        for (const Vec3d& p : points) {
            const auto landed = mGrid.worldToIndex(openvdb::Vec3d(p[0], p[1], p[2]));
            if (hasVoxel(landed)) mFrontier.addAround(Coord::floor(landed), 0, 1);
        }
    }

    /// Evaluates the result at these voxels. Adds the neighbours of those that differ from the background to the
    /// frontier.
    void evaluate(const std::vector<Coord>& voxels, const Monitor& monitor) {
        requireMemory(static_cast<double>(voxels.size()) * (sizeof(Vec3d) + 2 * sizeof(Value)),
                      fmt::format("the grid, which has grown to {} voxels,", mTraced + voxels.size()),
                      "advect it for a shorter time, or choose larger voxels");
        std::vector<Vec3d> origins;
        origins.reserve(voxels.size());
        for (const Coord& voxel : voxels) {
            const auto p = mGrid.indexToWorld(voxel);
            origins.push_back({{p[0], p[1], p[2]}});
        }
        mTraced += voxels.size();
        const FlowMapResult traced = mMap.carry(origins, mEnd, mBegin, monitor);
        mStalled += traced.stalled;
        mOverrun += traced.overrun;
        std::vector<Value> values(voxels.size());
        parallelFor(voxels.size(), 1024, [&](size_t begin, size_t end) {
            const auto samples = mGrid.getConstUnsafeAccessor();
            for (size_t n = begin; n < end; ++n) {
                const auto at = mGrid.worldToIndex(openvdb::Vec3d(origins[n][0], origins[n][1], origins[n][2]));
                values[n] = !hasVoxel(at) ? mGrid.background()
                            : mInterpolation == Interpolation::linear
                                ? openvdb::tools::BoxSampler::sample(samples, at)
                                : openvdb::tools::QuadraticSampler::sample(samples, at);
            }
        });
        auto moved = mMoved->getAccessor();
        for (size_t n = 0; n < voxels.size(); ++n) {
            constexpr double kNothing = 1e-6; // rounding errors of the sampler
            if (!(sizeOf(values[n] - mGrid.background()) > kNothing * mMax)) continue;
            moved.setValueOn(voxels[n], values[n]);
            mFrontier.addAround(voxels[n], 1, 1);
        }
    }

    const GridT& mGrid;
    FlowMap mMap;
    double mBegin, mEnd;
    Interpolation mInterpolation;
    const Monitor& mMonitor;
    typename GridT::Ptr mMoved;
    Frontier mFrontier;
    double mMax = 0; // maximum difference from the background
    size_t mTraced = 0, mStalled = 0, mOverrun = 0;
};

} // namespace

AdvectedGrid advectGrid(const openvdb::GridBase& grid, const FlowInTime& flow, double begin, double time,
                        const GridAdvectionOptions& options, const Monitor& monitor) {
    const auto gridClass = grid.getGridClass();
    if (gridClass == openvdb::GRID_LEVEL_SET)
        throw ValueError(fmt::format(
            "grid '{}' is a level set and would not stay a signed distance; use -advectLevelSet", grid.getName()));
    if (gridClass == openvdb::GRID_STAGGERED)
        throw ValueError(fmt::format("grid '{}' is staggered; give one with values at voxel centres", grid.getName()));
    if (!grid.transform().isLinear())
        throw ValueError(fmt::format("grid '{}' does not have a linear transform", grid.getName()));
    if (const auto* floats = dynamic_cast<const openvdb::FloatGrid*>(&grid))
        return GridAdvector(*floats, flow, begin, time, options, monitor).run();
    if (const auto* vectors = dynamic_cast<const openvdb::Vec3SGrid*>(&grid))
        return GridAdvector(*vectors, flow, begin, time, options, monitor).run();
    throw ValueError(fmt::format("grid '{}' is a {} grid; only float and vec3s grids can be advected", grid.getName(),
                                 grid.valueType()));
}

} // namespace curlew
