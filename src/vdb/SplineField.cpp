// SPDX-License-Identifier: Apache-2.0
#include "SplineField.h"

#include "LeafTable.h"
#include "SplineContraction.h"
#include "SplineLattice.h"
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/math/Dispatch.h"
#include "curlew/vdb/LevelSet.h"
#include "curlew/vdb/Openvdb.h"

#include <openvdb/tree/LeafManager.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <map>
#include <memory>
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
            const bool few = Order > 2 || points.size <= 2; // there are no lanes for third derivatives
            if constexpr (Order <= 2)
                if (!few) runKernel<SplineKernel<Order>, T>(std::as_const(places), mToIndex, jets);
            if (few) SplineKernel<Order>::template run<T>(places, mToIndex, jets);
        }
        for (int i = 0; i < points.size; ++i)
            if (const float beyond = level[static_cast<size_t>(i)]; beyond != kInBand)
                jets.set(i, Jet<T, 3, Order>(static_cast<T>(beyond)));
    }

    template <int Order, class T>
    OnLattice<T, Order> onLattice(const PointLattice& lattice) const {
        std::array<SplineLattice::Axis, 3> axes;
        if (!place(lattice, axes)) return {};
        if (!SplineLattice::pays(axes, lattice.size())) return {};
        SplineLattice spline(axes);
        const openvdb::tree::ValueAccessor<const openvdb::FloatTree, /*IsSafe=*/false> levels(mGrid->tree());
        spline.collect([&](int i, int j, int k) -> SplineLattice::Leaf {
            const Coord leaf(i, j, k);
            const int32_t number = mBlockOf.find(leaf);
            if (number == LeafTable::kNone) return {nullptr, levels.getValue(leaf << 3)};
            return {mBlocks[static_cast<size_t>(number)].data(), 0};
        });
        const auto jets = std::make_shared<LatticeJets<T, Order>>(spline);
        if (spline.anyInBand())
            runOnLines<SplineLatticeKernel<Order>, T>(spline.axes()[2].base.size(), std::as_const(spline), mToIndex,
                                                      *jets);
        jets->fillBeyond(spline);
        return [jets](const LatticeBatch& batch, JetBatch<T, Order>& to) { jets->copy(batch, to); };
    }

    /// The same from buffers: a dense index of the leaves, and the coefficients of the blocks and the levels of tiles.
    template <int Order>
    Jet<Symbol<float>, 3, Order> symbols(SymbolModule& module, const Vec<Symbol<double>, 3>& p) const {
        using S = Symbol<float>;
        using P = Symbol<double>;
        using Word = Symbol<uint32_t>;
        const Dense dense = makeDense();
        Vec<P, 3> rest;
        std::array<Word, 3> voxel;
        Symbol<bool> outside(false);
        for (int axis = 0; axis < 3; ++axis) {
            P x(mShift[axis]);
            for (int k = 0; k < 3; ++k) x = mulAdd(P(mToIndex[axis][k]), p[k], x);
            const P base = floor(x);
            rest[axis] = x - base;
            const S i = convertTo<S>(base - P(8 * dense.lowest[axis])), last(8 * dense.size[axis] - 1);
            outside = outside | (i < S(0)) | (i > last);
            voxel[static_cast<size_t>(axis)] = convertTo<Word>(min(max(i, S(0)), last));
        }
        Word leaf(0), local(0);
        for (size_t axis = 0; axis < 3; ++axis) {
            leaf = leaf * Word(dense.size[static_cast<int>(axis)]) + (voxel[axis] >> 3);
            local = local * Word(kBlock) + (voxel[axis] & Word(7));
        }
        const auto number = Word(module.load({{}, SymbolType::word, dense.leaves}, leaf.any()));
        const Symbol<bool> inBand = number < Word(Dense::kLevel) & !outside;
        const auto coefficient = [&](const Word& at) {
            return S(module.load({{}, SymbolType::real, dense.values}, at.any()));
        };
        const Word corner = select(inBand, number, Word(0)) * Word(kBlock * kBlock * kBlock) + local;
        const auto jet = contractedSpline<Order>(splineWeights<Order, S>(rest), [&](size_t i, size_t j) {
            std::array<S, 4> row;
            for (size_t k = 0; k < 4; ++k) row[k] = coefficient(corner + Word((i * kBlock + j) * kBlock + k));
            return row;
        });
        const Word background(dense.background), beyond = select(outside, background, number & Word(~Dense::kLevel));
        const S level = coefficient(select(inBand, background, beyond));
        return select(inBand, pullBack(jet, mToIndex), Jet<S, 3, Order>(level));
    }

    /// The values of a spline lie between its coefficients.
    Interval range() const { return mRange; }
    /// Maximum length of the gradient, from the central differences of the coefficients, of which the gradient is an
    /// average.
    double lipschitz() const { return mLipschitz; }

  private:
    static constexpr int kBlock = SplineContraction::kBlock;
    using Block = std::array<float, kBlock * kBlock * kBlock>;

    /// The field as buffers.
    struct Dense {
        static constexpr uint32_t kLevel = 0x80000000; ///< The rest of the word is the index of a level.
        static constexpr size_t kMostLeaves = size_t{1} << 24;
        Coord lowest, size; ///< A box of leaves.
        uint32_t background;
        /// For each leaf in the box, z fastest: the number of its block, or kLevel and an index in `values`.
        std::shared_ptr<std::vector<uint32_t>> leaves = std::make_shared<std::vector<uint32_t>>();
        /// The bits of the coefficients of all blocks, the background, then the levels of tiles.
        std::shared_ptr<std::vector<uint32_t>> values = std::make_shared<std::vector<uint32_t>>();
    };

    /// Places a lattice in the grid. Returns whether its axes are those of the grid, and its coordinates ascending.
    bool place(const PointLattice& lattice, std::array<SplineLattice::Axis, 3>& axes) const {
        if (lattice.size() == 0) return false;
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                if (i != j && mToIndex[i][j] != 0) return false;
        for (size_t axis = 0; axis < 3; ++axis) {
            axes[axis].reserve(lattice.coordinates[axis].size());
            for (const double p : lattice.coordinates[axis]) {
                const int k = static_cast<int>(axis);
                if (!axes[axis].add(mulAdd(mToIndex[k][k], p, mShift[k]))) return false;
            }
        }
        return true;
    }

    Dense makeDense() const {
        openvdb::CoordBBox voxels;
        mGrid->tree().evalLeafBoundingBox(voxels);
        voxels.expand(mGrid->evalActiveVoxelBoundingBox());
        Dense dense{.lowest = leafOf(voxels.min()),
                    .size = leafOf(voxels.max()) - leafOf(voxels.min()) + Coord(1),
                    .background = 0};
        const auto count = static_cast<double>(dense.size[0]) * dense.size[1] * dense.size[2];
        if (!(count <= static_cast<double>(Dense::kMostLeaves)))
            throw ValueError("the narrow band of a level set extends too far for a shader; use larger voxels");
        for (const Block& block : mBlocks)
            for (const float c : block) dense.values->push_back(std::bit_cast<uint32_t>(c));
        std::map<float, uint32_t> levels;
        const auto levelOf = [&](float level) {
            const auto [place, added] = levels.try_emplace(level, static_cast<uint32_t>(dense.values->size()));
            if (added) dense.values->push_back(std::bit_cast<uint32_t>(level));
            return place->second;
        };
        dense.background = levelOf(mGrid->background());
        const openvdb::tree::ValueAccessor<const openvdb::FloatTree, /*IsSafe=*/false> values(mGrid->tree());
        for (int i = 0; i < dense.size[0]; ++i)
            for (int j = 0; j < dense.size[1]; ++j)
                for (int k = 0; k < dense.size[2]; ++k) {
                    const Coord leaf = dense.lowest + Coord(i, j, k);
                    const int32_t number = mBlockOf.find(leaf);
                    const bool inBand = number != LeafTable::kNone;
                    dense.leaves->push_back(inBand ? static_cast<uint32_t>(number)
                                                   : Dense::kLevel | levelOf(values.getValue(leaf << 3)));
                }
        return dense;
    }

    static Coord leafOf(const Coord& ijk) { return {ijk[0] >> 3, ijk[1] >> 3, ijk[2] >> 3}; }

    void buildBlocks() {
        std::vector<const openvdb::FloatTree::LeafNodeType*> leaves;
        mGrid->tree().getNodes(leaves);
        mBlocks.resize(leaves.size());
        std::vector<Coord> coordinates;
        coordinates.reserve(leaves.size());
        for (const auto* leaf : leaves) coordinates.push_back(leafOf(leaf->origin()));
        mBlockOf = LeafTable(coordinates);
        parallelFor(leaves.size(), 16, [&](size_t begin, size_t end) {
            const openvdb::tree::ValueAccessor<const openvdb::FloatTree, false> samples(mGrid->tree());
            for (size_t n = begin; n < end; ++n) fill(mBlocks[n], leaves[n]->origin(), samples);
        });
        const auto widen = [&](float c) {
            mRange = {std::min(mRange.lower, static_cast<double>(c)), std::max(mRange.upper, static_cast<double>(c))};
        };
        mRange = {static_cast<double>(mGrid->background()), static_cast<double>(mGrid->background())};
        auto tile = mGrid->tree().cbeginValueAll();
        tile.setMaxDepth(openvdb::FloatTree::ValueAllCIter::LEAF_DEPTH - 1);
        for (; tile; ++tile) widen(*tile);
        for (const Block& block : mBlocks)
            for (const float c : block) widen(c);
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
    Interval mRange; // of all coefficients, tiles and the background
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
