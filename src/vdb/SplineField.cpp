// SPDX-License-Identifier: Apache-2.0
#include "SplineField.h"

#include "SplineBlocks.h"
#include "SplineContraction.h"
#include "SplineLattice.h"
#include "curlew/base/Error.h"
#include "curlew/math/Dispatch.h"
#include "curlew/vdb/LevelSet.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>
#include <bit>
#include <map>
#include <memory>
#include <utility>
#include <vector>

namespace curlew {

namespace {

using openvdb::Coord;

/// The tricubic B-spline of a narrow band. Where there is no block of coefficients, it is the value of the grid there,
/// or the spline that continues it.
class SplineField {
  public:
    explicit SplineField(openvdb::FloatGrid::ConstPtr grid) : SplineField(std::move(grid), 0, nullptr) {}
    /// `reach`: see SplineBlocks.
    SplineField(openvdb::FloatGrid::ConstPtr grid, double reach, std::shared_ptr<const SplineField> beyond)
        : mGrid(std::move(grid)), mBeyond(std::move(beyond)) {
        const auto& map = *mGrid->transform().baseMap();
        const openvdb::Mat4d toIndex = map.getAffineMap()->getMat4().inverse(); // row vectors: x_index = x_world M
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) mToIndex[i][j] = toIndex(j, i);
            mShift[i] = toIndex(3, i);
        }
        mBlocks = SplineBlocks(mGrid, reach, mBeyond ? &mBeyond->mBlocks : nullptr);
    }

    template <int Order, class T>
    void evalBatch(const PointBatch& points, JetBatch<T, Order>& jets) const {
        Located located;
        locate(points, located);
        const SplineContraction::Places& places = located.places;
        if (places.size == points.size) return contract(places, jets);
        if (places.size > 0) {
            JetBatch<T, Order> inBand;
            contract(places, inBand);
            for (int n = 0; n < places.size; ++n) jets.set(located.lane[static_cast<size_t>(n)], inBand[n]);
        }
        // The others follow, from the last lane on.
        const int count = points.size - places.size;
        const auto lane = [&](int n) { return located.lane[static_cast<size_t>(points.size - 1 - n)]; };
        if (!mBeyond) {
            for (int n = 0; n < count; ++n)
                jets.set(lane(n), Jet<T, 3, Order>(static_cast<T>(located.level[static_cast<size_t>(lane(n))])));
            return;
        }
        PointBatch rest;
        for (int n = 0; n < count; ++n) rest.push(points[lane(n)]);
        JetBatch<T, Order> there;
        mBeyond->evalBatch<Order, T>(rest, there);
        for (int n = 0; n < count; ++n) jets.set(lane(n), there[n]);
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
            if (const float* block = mBlocks.at(leaf)) return {block, 0};
            return {nullptr, levels.getValue(leaf << 3)};
        });
        OnLattice<T, Order> there;
        if (mBeyond && spline.anyBeyond()) {
            there = mBeyond->onLattice<Order, T>(lattice);
            if (!there || !spline.anyInBand()) return there;
        }
        const auto jets = std::make_shared<LatticeJets<T, Order>>(spline);
        if (spline.anyInBand())
            runOnLine<SplineLatticeKernel<Order>, T>(spline.axes()[2].base.size(), std::as_const(spline), mToIndex,
                                                     *jets);
        if (!there) {
            jets->fillBeyond(spline);
            return [jets](const LatticeBatch& batch, JetBatch<T, Order>& to) { jets->copy(batch, to); };
        }
        std::vector<uint8_t> isBeyond(lattice.combinations());
        spline.forRowsBeyond([&](size_t first, size_t count, float) { std::fill_n(&isBeyond[first], count, 1); });
        return [jets, there = std::move(there), isBeyond = std::move(isBeyond)](const LatticeBatch& batch,
                                                                                JetBatch<T, Order>& to) {
            JetBatch<T, Order> other;
            jets->copy(batch, to);
            there(batch, other);
            for (int i = 0; i < batch.size(); ++i)
                if (isBeyond[batch.number(i)] != 0) to.set(i, other[i]);
        };
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
        return select(inBand, pullBack(jet, mToIndex),
                      mBeyond ? mBeyond->symbols<Order>(module, p) : Jet<S, 3, Order>(level));
    }

    Interval range() const {
        if (!mBeyond) return mBlocks.range();
        const Interval near = mBlocks.range(), far = mBeyond->range();
        return {std::min(near.lower, far.lower), std::max(near.upper, far.upper)};
    }
    double lipschitz() const {
        return mBeyond ? std::max(mBlocks.lipschitz(), mBeyond->lipschitz()) : mBlocks.lipschitz();
    }

  private:
    static constexpr int kBlock = SplineContraction::kBlock;

    /// The positions of a batch in the band, and all lanes: first theirs, then, from the last one on, the others.
    struct Located {
        SplineContraction::Places places;
        std::array<int, kBatch> lane;
        std::array<float, kBatch> level; ///< By lane, of the others.
    };

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
        const auto leafOf = [](const Coord& ijk) { return SplineBlocks::leafOf(ijk); };
        Dense dense{.lowest = leafOf(voxels.min()),
                    .size = leafOf(voxels.max()) - leafOf(voxels.min()) + Coord(1),
                    .background = 0};
        const auto count = static_cast<double>(dense.size[0]) * dense.size[1] * dense.size[2];
        if (!(count <= static_cast<double>(Dense::kMostLeaves)))
            throw ValueError("the narrow band of a level set extends too far for a shader; use larger voxels");
        for (const SplineBlocks::Block& block : mBlocks.all())
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
                    const int32_t number = mBlocks.numberOf(leaf);
                    const bool inBand = number != LeafTable::kNone;
                    dense.leaves->push_back(inBand ? static_cast<uint32_t>(number)
                                                   : Dense::kLevel | levelOf(values.getValue(leaf << 3)));
                }
        return dense;
    }

    /// Finds the coefficients of the positions in the band.
    void locate(const PointBatch& points, Located& located) const {
        static constexpr SplineBlocks::Block kNoBlock{};
        SplineContraction::Places& places = located.places;
        SplinePlaces found;
        const double slots = mBlocks.table().slots();
        runKernel<PlaceKernel, double>(points, mToIndex, mShift, slots, found);
        const openvdb::tree::ValueAccessor<const openvdb::FloatTree, /*IsSafe=*/false> levels(mGrid->tree());
        int last = points.size;
        for (int i = 0; i < points.size; ++i) {
            const auto n = static_cast<size_t>(i);
            const float* const block = mBlocks.at(found.key(n));
            if (!block) {
                located.lane[static_cast<size_t>(--last)] = i;
                if (mBeyond) continue;
                const Vec3d leaf = found.leaf[i];
                const Coord origin(static_cast<int>(leaf[0]), static_cast<int>(leaf[1]), static_cast<int>(leaf[2]));
                located.level[n] = levels.getValue(origin << 3);
                continue;
            }
            const auto to = static_cast<size_t>(places.size++);
            located.lane[to] = i;
            places.corner[to] = block + static_cast<size_t>(found.inBlock[n]);
            for (size_t axis = 0; axis < 3; ++axis) places.fraction.c[axis][to] = found.fraction.c[axis][n];
        }
        std::fill(places.corner.begin() + places.size, places.corner.end(),
                  kNoBlock.data()); // lanes without a position
    }

    template <int Order, class T>
    void contract(const SplineContraction::Places& places, JetBatch<T, Order>& jets) const {
        const bool few = Order > 2 || places.size <= 2; // there are no lanes for third derivatives
        if constexpr (Order <= 2)
            if (!few) return runKernel<SplineKernel<Order>, T>(places, mToIndex, jets);
        SplineKernel<Order>::template run<T>(places, mToIndex, jets);
    }

    openvdb::FloatGrid::ConstPtr mGrid;
    std::shared_ptr<const SplineField> mBeyond;
    Matrix3 mToIndex;
    Vec3d mShift;
    SplineBlocks mBlocks;
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

Sdf sdfOf(const LevelSet& levelSet) { return sdfOfBands({&levelSet, 1}); }

Sdf sdfOfBands(std::span<const LevelSet> bands) {
    const auto reachOf = [](const LevelSet& band) {
        return std::max(band.halfWidth() - kSplineSupport, 0.0) * band.voxelSize();
    };
    std::shared_ptr<const SplineField> beyond;
    for (size_t n = bands.size(); n-- > 1;)
        beyond = std::make_shared<const SplineField>(bands[n].grid, reachOf(bands[n]), std::move(beyond));
    SplineField spline(bands[0].grid, reachOf(bands[0]), std::move(beyond));
    const double lipschitz = spline.lipschitz();
    return {.distance = ScalarField(std::move(spline)),
            .bounds = boundsOf(bands.front()),
            .reach = reachOf(bands.back()),
            .lipschitz = lipschitz};
}

} // namespace curlew
