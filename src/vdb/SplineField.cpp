// SPDX-License-Identifier: Apache-2.0
#include "SplineField.h"

#include "LeafTable.h"
#include "SplineContraction.h"
#include "curlew/base/Parallel.h"
#include "curlew/math/Dispatch.h"
#include "curlew/vdb/LevelSet.h"

#include <openvdb/tree/LeafManager.h>

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

namespace curlew {

namespace {

using openvdb::Coord;

/// A tricubic B-spline on the leaves of a narrow band. Each leaf stores all the coefficients that a position in it
/// needs, including its neighbours', in one block. So a lookup is one entry of a table and 64 values close together in
/// memory.
class SplineField {
  public:
    explicit SplineField(openvdb::FloatGrid::ConstPtr grid) : mGrid(std::move(grid)) {
        const auto& map = *mGrid->transform().baseMap();
        const openvdb::Mat4d toIndex = map.getAffineMap()->getMat4().inverse(); // row vectors: x_index = x_world M
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) mToIndex[i][j] = toIndex(j, i);
            mShift[i] = toIndex(3, i);
        }
        buildBlocks();
    }

    template <int Order, class T>
    void evalBatch(const PointBatch& points, JetBatch<T, Order>& jets) const {
        SplineContraction::Places places;
        places.size = points.size;
        std::array<float, kBatch> level;
        if (find(points, places, level)) {
            constexpr bool kHasLanes = Order <= 2;
            if (kHasLanes && points.size > 2) {
                if constexpr (kHasLanes) runKernel<SplineKernel<Order>, T>(std::as_const(places), mToIndex, jets);
            } else {
                SplineKernel<Order>::template run<T>(places, mToIndex, jets);
            }
        }
        for (int i = 0; i < points.size; ++i)
            if (const float beyond = level[static_cast<size_t>(i)]; beyond != kInBand)
                jets.set(i, Jet<T, 3, Order>(static_cast<T>(beyond)));
    }

    /// The values of a spline lie between its coefficients.
    Interval range() const { return Interval::within(mMax); }
    /// Maximum length of the gradient, from the central differences of the coefficients, of which the gradient is an
    /// average.
    double lipschitz() const { return mLipschitz; }

  private:
    static constexpr int kBlock = SplineContraction::kBlock;
    using Block = std::array<float, kBlock * kBlock * kBlock>;

    static Coord leafOf(const Coord& ijk) { return {ijk[0] >> 3, ijk[1] >> 3, ijk[2] >> 3}; }

    void buildBlocks() {
        std::vector<const openvdb::FloatTree::LeafNodeType*> leaves;
        mGrid->tree().getNodes(leaves);
        mBlocks.resize(leaves.size());
        std::vector<Coord> coordinates;
        for (const auto* leaf : leaves) coordinates.push_back(leafOf(leaf->origin()));
        mBlockOf = LeafTable(coordinates);
        parallelFor(leaves.size(), 16, [&](size_t begin, size_t end) {
            const openvdb::tree::ValueAccessor<const openvdb::FloatTree, false> samples(mGrid->tree());
            for (size_t n = begin; n < end; ++n) fill(mBlocks[n], leaves[n]->origin(), samples);
        });
        mMax = static_cast<double>(mGrid->background());
        for (const Block& block : mBlocks)
            for (const float c : block) mMax = std::max(mMax, std::abs(static_cast<double>(c)));
        constexpr size_t kGrain = 64;
        std::vector<float> steepest((mBlocks.size() + kGrain - 1) / kGrain);
        parallelFor(mBlocks.size(), kGrain, [&](size_t begin, size_t end) {
            for (size_t n = begin; n < end; ++n)
                steepest[begin / kGrain] = std::max(steepest[begin / kGrain], steepestIn(mBlocks[n]));
        });
        mLipschitz = static_cast<double>(*std::max_element(steepest.begin(), steepest.end())) / mGrid->voxelSize()[0];
    }

    template <class Accessor>
    static void fill(Block& block, const Coord& origin, const Accessor& samples) {
        constexpr int kRim = kBlock + 2; // the prefilter needs one more sample on each side
        std::array<float, kRim * kRim * kRim> s;
        size_t n = 0;
        for (int i = -2; i < kRim - 2; ++i)
            for (int j = -2; j < kRim - 2; ++j)
                for (int k = -2; k < kRim - 2; ++k) s[n++] = samples.getValue(origin.offsetBy(i, j, k));
        n = 0;
        for (int i = 1; i <= kBlock; ++i)
            for (int j = 1; j <= kBlock; ++j)
                for (int k = 1; k <= kBlock; ++k) {
                    const auto at = [&](int a, int b, int c) {
                        const int index = (a * kRim + b) * kRim + c;
                        return static_cast<double>(s[static_cast<size_t>(index)]);
                    };
                    const double around = at(i - 1, j, k) + at(i + 1, j, k) + at(i, j - 1, k) + at(i, j + 1, k) +
                                          at(i, j, k - 1) + at(i, j, k + 1);
                    block[n++] = static_cast<float>(2 * at(i, j, k) - around / 6);
                }
    }

    /// Returns the longest gradient between the coefficients of a block, per voxel.
    static float steepestIn(const Block& block) {
        constexpr size_t kX = kBlock * kBlock, kY = kBlock;
        float squared = 0;
        for (size_t i = 1; i < kBlock - 1; ++i)
            for (size_t j = 1; j < kBlock - 1; ++j)
                for (size_t k = 1; k < kBlock - 1; ++k) {
                    const float* c = &block[i * kX + j * kY + k];
                    const float x = c[kX] - *(c - kX), y = c[kY] - *(c - kY), z = c[1] - *(c - 1);
                    squared = std::max(squared, x * x + y * y + z * z);
                }
        return std::sqrt(squared) / 2;
    }

    static constexpr float kInBand = std::numeric_limits<float>::infinity(); // no level beyond the band has this value

    /// Finds the coefficients of the positions in the band. Returns whether there are any. Positions beyond the band
    /// get arbitrary coefficients and a level.
    bool find(const PointBatch& points, SplineContraction::Places& places, std::array<float, kBatch>& level) const {
        static constexpr Block kNoBlock{};
        places.corner.fill(kNoBlock.data()); // also for lanes without a position
        PointBatch voxel;
        runKernel<VoxelKernel, double>(points, mToIndex, mShift, voxel, places.fraction);
        const openvdb::tree::ValueAccessor<const openvdb::FloatTree, /*IsSafe=*/false> levels(mGrid->tree());
        bool any = false;
        for (size_t n = 0; n < static_cast<size_t>(points.size); ++n) {
            const Coord base(static_cast<int>(voxel.c[0][n]), static_cast<int>(voxel.c[1][n]),
                             static_cast<int>(voxel.c[2][n]));
            const int32_t number = mBlockOf.find(leafOf(base));
            if (number == LeafTable::kNone) {
                level[n] = levels.getValue(base);
                continue;
            }
            any = true;
            level[n] = kInBand;
            places.corner[n] = mBlocks[static_cast<size_t>(number)].data() +
                               ((base[0] & 7) * kBlock + (base[1] & 7)) * kBlock + (base[2] & 7);
        }
        return any;
    }

    openvdb::FloatGrid::ConstPtr mGrid;
    Matrix3 mToIndex;
    Vec3d mShift;
    double mMax = 0; // maximum magnitude of all coefficients and the background
    double mLipschitz = 0;
    LeafTable mBlockOf; // the number of each leaf is that of its block
    std::vector<Block> mBlocks;
};

} // namespace

Box boundsOf(const LevelSet& levelSet) {
    const openvdb::FloatGrid& grid = *levelSet.grid;
    openvdb::CoordBBox voxels;
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf)
        for (auto value = leaf->cbeginValueOn(); value; ++value)
            if (*value < 0) voxels.expand(value.getCoord());
    voxels.expand(1);
    const auto world = grid.transform().indexToWorld(openvdb::BBoxd(voxels.min().asVec3d(), voxels.max().asVec3d()));
    return {{{world.min()[0], world.min()[1], world.min()[2]}}, {{world.max()[0], world.max()[1], world.max()[2]}}};
}

ScalarField splineOf(openvdb::FloatGrid::ConstPtr grid) { return ScalarField(SplineField(std::move(grid))); }

Sdf sdfOf(const LevelSet& levelSet) {
    const SplineField spline(levelSet.grid);
    return {.distance = ScalarField(spline),
            .bounds = boundsOf(levelSet),
            .reach = std::max(levelSet.halfWidth() - kSplineSupport, 0.0) * levelSet.voxelSize(),
            .lipschitz = spline.lipschitz()};
}

} // namespace curlew
