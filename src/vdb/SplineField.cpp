#include "curlew/base/Parallel.h"
#include "curlew/vdb/LevelSet.h"

#include <openvdb/tree/LeafManager.h>

#include <vector>

namespace curlew {

namespace {

using openvdb::Coord;

/// The weights of the four samples around t in [0, 1), or their derivatives with respect to t up to the third, of the
/// uniform cubic B-spline.
template <class T>
std::array<T, 4> splineWeights(T t, int derivative) {
    const T s = T(1) - t;
    switch (derivative) {
        case 0:
            return {s * s * s / T(6), (t * t * (T(3) * t - T(6)) + T(4)) / T(6),
                    (s * s * (T(3) * s - T(6)) + T(4)) / T(6), t * t * t / T(6)};
        case 1:
            return {T(-0.5) * s * s, t * (T(1.5) * t - T(2)), s * (T(2) - T(1.5) * s), T(0.5) * t * t};
        case 2:
            return {s, T(3) * t - T(2), T(1) - T(3) * t, t};
        default:
            return {T(-1), T(3), T(-3), T(1)};
    }
}

/// A tricubic B-spline on the leaves of a narrow band. Each leaf keeps all the coefficients that a position in it can
/// need, neighbours' included, in one block: so a lookup is one descent of a tree and 64 values that lie together.
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
        const openvdb::tree::ValueAccessor<const openvdb::Int32Tree, /*IsSafe=*/false> blocks(*mBlockOf);
        for (int i = 0; i < points.size; ++i)
            jets.set(i, pullBack(inIndexSpace<Order, T>(mToIndex * points[i] + mShift, blocks), mToIndex));
    }

    /// A spline lies between its coefficients.
    Range range() const { return Range::within(mMost); }

  private:
    static constexpr int kLeaf = 8, kBlock = kLeaf + 3; // one coefficient below, two above
    using Block = std::array<float, kBlock * kBlock * kBlock>;

    static Coord leafOf(const Coord& ijk) { return {ijk[0] >> 3, ijk[1] >> 3, ijk[2] >> 3}; }

    void buildBlocks() {
        std::vector<const openvdb::FloatTree::LeafNodeType*> leaves;
        mGrid->tree().getNodes(leaves);
        mBlocks.resize(leaves.size());
        for (size_t n = 0; n < leaves.size(); ++n)
            mBlockOf->setValueOnly(leafOf(leaves[n]->origin()), static_cast<int32_t>(n));
        parallelFor(leaves.size(), 16, [&](size_t begin, size_t end) {
            const openvdb::tree::ValueAccessor<const openvdb::FloatTree, false> samples(mGrid->tree());
            for (size_t n = begin; n < end; ++n) fill(mBlocks[n], leaves[n]->origin(), samples);
        });
        mMost = static_cast<double>(mGrid->background());
        for (const Block& block : mBlocks)
            for (const float c : block) mMost = std::max(mMost, std::abs(static_cast<double>(c)));
    }

    template <class Accessor>
    static void fill(Block& block, const Coord& origin, const Accessor& samples) {
        constexpr int kRim = kBlock + 2; // the prefilter needs one sample more on each side
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

    template <int Order, class T, class Accessor>
    Jet<T, 3, Order> inIndexSpace(const Vec3d& p, const Accessor& blocks) const {
        constexpr double kFar = 0x1p30;
        for (const double c : p.c)
            if (!(std::abs(c) < kFar)) return static_cast<T>(mGrid->background());
        const Coord base(static_cast<int>(std::floor(p[0])), static_cast<int>(std::floor(p[1])),
                         static_cast<int>(std::floor(p[2])));
        const int32_t n = blocks.getValue(leafOf(base));
        if (n < 0) return static_cast<T>(mGrid->tree().getValue(base));
        const Vec3<T> t{
            {static_cast<T>(p[0] - base[0]), static_cast<T>(p[1] - base[1]), static_cast<T>(p[2] - base[2])}};
        const float* corner =
            mBlocks[static_cast<size_t>(n)].data() + ((base[0] & 7) * kBlock + (base[1] & 7)) * kBlock + (base[2] & 7);
        return contract<Order>(corner, t);
    }

    /// Sums the 64 coefficients along z, then y, then x, with the weights of every derivative that the order asks for.
    template <int Order, class T>
    static Jet<T, 3, Order> contract(const float* corner, const Vec3<T>& t) {
        std::array<std::array<std::array<T, 4>, Order + 1>, 3> w; // [axis][derivative][sample]
        for (int axis = 0; axis < 3; ++axis)
            for (int d = 0; d <= Order; ++d)
                w[static_cast<size_t>(axis)][static_cast<size_t>(d)] = splineWeights(t[axis], d);
        std::array<std::array<std::array<T, Order + 1>, Order + 1>, Order + 1> sum{}; // [d/dx][d/dy][d/dz]
        for (size_t i = 0; i < 4; ++i) {
            std::array<std::array<T, Order + 1>, Order + 1> plane{};
            for (size_t j = 0; j < 4; ++j) {
                const float* row = corner + (i * kBlock + j) * kBlock;
                for (size_t dz = 0; dz <= Order; ++dz) {
                    T line = 0;
                    for (size_t k = 0; k < 4; ++k) line += static_cast<T>(row[k]) * w[2][dz][k];
                    for (size_t dy = 0; dy + dz <= Order; ++dy) plane[dy][dz] += line * w[1][dy][j];
                }
            }
            for (size_t dx = 0; dx <= Order; ++dx)
                for (size_t dy = 0; dx + dy <= Order; ++dy)
                    for (size_t dz = 0; dx + dy + dz <= Order; ++dz) sum[dx][dy][dz] += plane[dy][dz] * w[0][dx][i];
        }
        Jet<T, 3, Order> jet(sum[0][0][0]);
        if constexpr (Order >= 1) jet.gradient = {{sum[1][0][0], sum[0][1][0], sum[0][0][1]}};
        if constexpr (Order >= 2)
            jet.hessian.c = {sum[2][0][0], sum[0][2][0], sum[0][0][2], sum[1][1][0], sum[1][0][1], sum[0][1][1]};
        if constexpr (Order >= 3)
            jet.forTriples([&](int i, int j, int k) {
                std::array<size_t, 3> d{};
                for (const int axis : {i, j, k}) ++d[static_cast<size_t>(axis)];
                jet.third(i, j, k) = sum[d[0]][d[1]][d[2]];
            });
        return jet;
    }

    openvdb::FloatGrid::ConstPtr mGrid;
    Matrix3 mToIndex;
    Vec3d mShift;
    double mMost = 0; // of all coefficients, and the background
    openvdb::Int32Tree::Ptr mBlockOf =
        std::make_shared<openvdb::Int32Tree>(-1); // one value per leaf, at the leaf's origin / 8
    std::vector<Block> mBlocks;
};

/// The box of the samples that are inside, and a voxel more.
Box insideOf(const openvdb::FloatGrid& grid) {
    openvdb::CoordBBox voxels;
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf)
        for (auto value = leaf->cbeginValueOn(); value; ++value)
            if (*value < 0) voxels.expand(value.getCoord());
    voxels.expand(1);
    const auto world = grid.transform().indexToWorld(openvdb::BBoxd(voxels.min().asVec3d(), voxels.max().asVec3d()));
    return {{{world.min()[0], world.min()[1], world.min()[2]}}, {{world.max()[0], world.max()[1], world.max()[2]}}};
}

} // namespace

Sdf sdfOf(const LevelSet& levelSet) {
    return {.distance = ScalarField(SplineField(levelSet.grid)),
            .bounds = insideOf(*levelSet.grid),
            .reach = std::max(levelSet.halfWidth() - kSplineSupport, 0.0) * levelSet.voxelSize()};
}

} // namespace curlew
