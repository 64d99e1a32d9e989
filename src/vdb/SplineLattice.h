// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "SplineContraction.h"
#include "curlew/base/UninitializedArray.h"
#include "curlew/field/PointLattice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

namespace curlew {

/// A tricubic B-spline on a lattice whose axes are those of the spline, so that the sums along an axis serve all
/// positions with the same coordinate on it. Independent of OpenVDB.
class SplineLattice {
  public:
    /// Some of the positions along an axis, or of the coefficients.
    struct Range {
        size_t begin = std::numeric_limits<size_t>::max(), end = 0;

        bool empty() const { return begin >= end; }
        size_t size() const { return empty() ? 0 : end - begin; }
        void include(const Range& other) {
            begin = std::min(begin, other.begin);
            end = std::max(end, other.end);
        }
    };

    /// Positions along an axis in voxels of the spline.
    struct Axis {
        std::vector<int> base; ///< The voxel below each position; ascending.
        std::vector<double> fraction;

        /// Makes room for so many positions.
        void reserve(size_t count) {
            base.reserve(count);
            fraction.reserve(count);
        }
        /// Takes a position, and returns whether it is not below the last one.
        bool add(double x) {
            const double below = floor(x);
            if (!(std::abs(x) < PlaceKernel::kNowhere) || (!base.empty() && below < base.back())) return false;
            base.push_back(static_cast<int>(below));
            fraction.push_back(x - below);
            return true;
        }
        int firstLeaf() const { return base.front() >> 3; }
        int lastLeaf() const { return base.back() >> 3; }
        /// The leaf with this number along the axis.
        int leaf(size_t number) const { return firstLeaf() + static_cast<int>(number); }
        /// The number of the leaf of a position.
        size_t leafNumber(size_t position) const {
            const int leaves = (base[position] >> 3) - firstLeaf();
            return static_cast<size_t>(leaves);
        }
        /// The number of coefficients from the first to the last.
        size_t reach() const {
            const int count = base.back() - base.front() + 4;
            return static_cast<size_t>(count);
        }
        /// The first of the four coefficients of a position, relative to the first one of the axis.
        size_t from(size_t position) const {
            const int steps = base[position] - base.front();
            return static_cast<size_t>(steps);
        }
        /// The coefficients that positions need.
        Range coefficientsOf(const Range& positions) const {
            return {from(positions.begin), from(positions.end - 1) + 4};
        }
        /// The coefficients in the block of a leaf, relative to the first one of the axis, and where they are in it.
        struct Rows {
            size_t first, count, local;
        };
        /// Without those that the block of the leaf before has too, if `after` it.
        Rows rowsOf(int leaf, bool after) const {
            const int lowest = leaf * kLeaf - 1;
            const int begin = after ? lowest + kBlock - kLeaf : std::max(lowest, base.front() - 1);
            const int end = std::min(lowest + kBlock, base.back() + 3);
            return {static_cast<size_t>(begin - (base.front() - 1)), static_cast<size_t>(std::max(end - begin, 0)),
                    static_cast<size_t>(begin - lowest)};
        }
    };
    /// The block of coefficients of a leaf; nullptr beyond the band, where the spline is `level`.
    struct Leaf {
        const float* block;
        float level;
    };

    /// Whether this is cheaper than to compute so many positions one by one.
    static bool pays(const std::array<Axis, 3>& axes, size_t positions) {
        const auto& [x, y, z] = axes;
        return z.base.size() >= kShortest && x.reach() * y.reach() * z.base.size() <= 8 * positions;
    }

    /// Refers to the axes.
    explicit SplineLattice(const std::array<Axis, 3>& axes) : mAxes(axes) {
        const int row = (axes[2].lastLeaf() - axes[2].firstLeaf()) * kLeaf + kBlock;
        mStep[1] = static_cast<size_t>(row);
        mStep[0] = axes[1].reach() * mStep[1];
        for (size_t axis = 0; axis < 3; ++axis) mLeaves[axis] = positionsByLeaf(axes[axis]);
    }

    const std::array<Axis, 3>& axes() const { return mAxes; }
    bool anyBeyond() const { return !mBeyond.empty(); }
    /// Calls use(first, count, level) with rows of positions beyond the band, by the number of their first one.
    template <class Use>
    void forRowsBeyond(const Use& use) const {
        const size_t line = mAxes[2].base.size(), plane = mAxes[1].base.size() * line;
        for (const auto& [x, y, z, level] : mBeyond)
            for (size_t i = x.begin; i < x.end; ++i)
                for (size_t j = y.begin; j < y.end; ++j)
                    if (!z.empty()) use(i * plane + j * line + z.begin, z.size(), level);
    }
    bool anyInBand() const { return mAnyInBand; }

    /// Collects the coefficients. `leafAt(i, j, k)` returns a leaf by its coordinates.
    template <class LeafAt>
    void collect(const LeafAt& leafAt) {
        const auto& [x, y, z] = mAxes;
        mCoefficients = uninitializedArray<float>(x.reach() * mStep[0]);
        const auto& [inX, inY, inZ] = mLeaves;
        const size_t plane = inY.size() * inZ.size();
        std::vector<bool> inBand(inX.size() * plane);
        std::vector<Range> ranges(plane);
        std::vector<Part> parts;
        parts.reserve(inBand.size());
        size_t n = 0;
        for (size_t i = 0; i < inX.size(); ++i)
            for (size_t j = 0; j < inY.size(); ++j)
                for (size_t k = 0; k < inZ.size(); ++k, ++n) {
                    const Leaf leaf = leafAt(x.leaf(i), y.leaf(j), z.leaf(k));
                    if (!leaf.block) {
                        mBeyond.push_back({inX[i], inY[j], inZ[k], leaf.level});
                        continue;
                    }
                    inBand[n] = true;
                    ranges[j * inZ.size() + k].include(inX[i]);
                    const bool afterX = i > 0 && inBand[n - plane], afterY = j > 0 && inBand[n - inZ.size()];
                    parts.push_back(
                        partOf(leaf.block, x.rowsOf(x.leaf(i), afterX), y.rowsOf(y.leaf(j), afterY), k * kLeaf));
                }
        for (size_t part = 0; part < parts.size(); ++part) {
            if (part + 1 < parts.size()) prefetch(parts[part + 1]);
            copy(parts[part]);
        }
        mAnyInBand = !parts.empty();
        noteNeeds(ranges);
    }

    /// The positions along x from the first to the last in the band, for one along y and some along z.
    Range positionsInBand(size_t y, size_t z, size_t count) const {
        return united(mPositions.data() + y, mAxes[1].base.size(), z, count);
    }
    /// The coefficients along x that these need, for one along y.
    Range coefficientsInBand(size_t y, size_t z, size_t count) const {
        return united(mNeeded.data() + y, mAxes[1].reach(), z, count);
    }
    const float* coefficients() const { return mCoefficients.get(); }
    /// Coefficients from one row along z to the next one along x, and along y.
    const std::array<size_t, 2>& step() const { return mStep; }
    /// Where the four coefficients of a position are in a row.
    size_t inRow(size_t position) const {
        const int steps = mAxes[2].base[position] - mAxes[2].firstLeaf() * kLeaf;
        return static_cast<size_t>(steps);
    }

  private:
    static constexpr int kLeaf = SplineContraction::kLeaf, kBlock = SplineContraction::kBlock;
    static constexpr size_t kShortest = 8; ///< Positions on a line along z: the fewest lanes of an instruction set.

    /// Rows of coefficients that are copied: `rows` along y in each of some planes.
    struct Part {
        const float* from;
        float* to;
        size_t planes, rows;
    };
    static constexpr size_t kRow{kBlock}, kPlane = kRow * kRow; ///< Coefficients in a row and a plane of a block.

    /// Positions in a leaf beyond the band.
    struct Beyond {
        Range x, y, z;
        float level;
    };

    static std::vector<Range> positionsByLeaf(const Axis& axis) {
        std::vector<Range> leaves(axis.leafNumber(axis.base.size() - 1) + 1);
        for (size_t n = 0; n < axis.base.size(); ++n) leaves[axis.leafNumber(n)].include({n, n + 1});
        return leaves;
    }

    /// Determines what the positions in the band need. `inBand`: the positions along x from the first to the last in
    /// the band, for each line of leaves [y][z].
    void noteNeeds(const std::vector<Range>& inBand) {
        const auto& [x, y, z] = mAxes;
        const size_t count = y.base.size(), reach = y.reach(), leaves = mLeaves[2].size();
        mPositions.resize(leaves * count);
        mNeeded.resize(leaves * reach);
        for (size_t j = 0; j < count; ++j)
            for (size_t k = 0; k < leaves; ++k) {
                const Range& positions = mPositions[k * count + j] = inBand[y.leafNumber(j) * leaves + k];
                if (positions.empty()) continue;
                const Range coefficients = x.coefficientsOf(positions);
                for (size_t n = 0; n < 4; ++n) mNeeded[k * reach + y.from(j) + n].include(coefficients);
            }
    }

    /// Unites the ranges of the leaves of positions along z. `step`: between the ranges of two leaves.
    Range united(const Range* ranges, size_t step, size_t z, size_t count) const {
        Range all;
        for (size_t k = mAxes[2].leafNumber(z); k <= mAxes[2].leafNumber(z + count - 1); ++k)
            all.include(ranges[k * step]);
        return all;
    }

    /// Returns rows of the block of a leaf, which go to this place along z.
    Part partOf(const float* block, const Axis::Rows& x, const Axis::Rows& y, size_t place) {
        return {block + x.local * kPlane + y.local * kRow,
                &mCoefficients[x.first * mStep[0] + y.first * mStep[1] + place], x.count, y.count};
    }
    /// Fetches the rows into the caches while others are copied.
    static void prefetch(const Part& part) {
        constexpr size_t kCacheLine = 16; // coefficients
        for (size_t i = 0; i < part.planes; ++i)
            for (size_t n = 0; n < part.rows * kRow; n += kCacheLine) __builtin_prefetch(part.from + i * kPlane + n);
    }
    /// Copies whole rows, so that the compiler knows their length.
    void copy(const Part& part) const {
        for (size_t i = 0; i < part.planes; ++i)
            for (size_t j = 0; j < part.rows; ++j)
                // Unlike std::copy_n, this becomes a few instructions.
                std::memcpy(part.to + i * mStep[0] + j * mStep[1], part.from + i * kPlane + j * kRow,
                            kRow * sizeof(float));
    }

    const std::array<Axis, 3>& mAxes;
    std::array<size_t, 2> mStep;
    UninitializedArray<float> mCoefficients;   ///< [x][y][z]; arbitrary where no position in the band needs them.
    std::array<std::vector<Range>, 3> mLeaves; ///< For each leaf along an axis, the positions in it.
    /// Along x, from the first to the last in the band: [leaf along z][position along y].
    std::vector<Range> mPositions;
    /// The coefficients along x that these need: [leaf along z][coefficient along y].
    std::vector<Range> mNeeded;
    bool mAnyInBand = false;
    std::vector<Beyond> mBeyond;
};

/// The weights of one position along an axis: [derivative][coefficient].
template <class T, int Order>
using AxisWeights = std::array<std::array<T, 4>, size_t{Order + 1}>;

/// One jet per position of a lattice, component by component, and the weights that they are made with.
template <class T, int Order>
class LatticeJets {
  public:
    explicit LatticeJets(const SplineLattice& lattice)
        : mX(weightsOf(lattice.axes()[0])), mY(weightsOf(lattice.axes()[1])) {
        mCount = mX.size() * mY.size() * lattice.axes()[2].base.size();
        mValues = uninitializedArray<T>(kSize * mCount);
    }

    /// The weights of each position along x, and along y.
    const std::vector<AxisWeights<T, Order>>& x() const { return mX; }
    const std::vector<AxisWeights<T, Order>>& y() const { return mY; }
    /// The values of a component.
    T* component(size_t k) { return mValues.get() + k * mCount; }
    const T* component(size_t k) const { return mValues.get() + k * mCount; }

    /// Sets the positions in leaves beyond the band to the level there.
    void fillBeyond(const SplineLattice& lattice) {
        lattice.forRowsBeyond([&](size_t first, size_t count, float level) {
            for (size_t k = 0; k < kSize; ++k)
                std::fill_n(component(k) + first, count, k == 0 ? static_cast<T>(level) : T(0));
        });
    }

    /// Copies the jets of a batch.
    void copy(const LatticeBatch& batch, JetBatch<T, Order>& jets) const {
        for (size_t k = 0; k < kSize; ++k) {
            const T* from = component(k);
            T* to = jets.c[k].data();
            batch.forEachRun(
                [&](size_t first, size_t number, size_t length) { std::copy_n(from + number, length, to + first); });
        }
    }

  private:
    static std::vector<AxisWeights<T, Order>> weightsOf(const SplineLattice::Axis& axis) {
        std::vector<AxisWeights<T, Order>> weights(axis.fraction.size());
        for (size_t n = 0; n < weights.size(); ++n)
            for (size_t d = 0; d <= Order; ++d)
                weights[n][d] = cubicBSplineWeights(static_cast<T>(axis.fraction[n]), static_cast<int>(d));
        return weights;
    }

    static constexpr size_t kSize{Jet<T, 3, Order>::kSize};

    std::vector<AxisWeights<T, Order>> mX, mY;
    size_t mCount; ///< Of the positions.
    UninitializedArray<T> mValues;
};

/// Computes jets of the spline, which is given in the coordinates A x + b, on a lattice: sums along z, then y, then x.
/// The operations on each position are those of contractedSpline(), so the bits are the same. Lanes are positions
/// on a line along z (runOnLine).
template <int Order>
struct SplineLatticeKernel {
    static_assert(Order <= 1);
    template <class T>
    using Line = std::array<T, size_t{Order + 1}>; ///< The value, and d/dz.
    template <class T>
    using Plane = std::array<T, Order == 0 ? 1 : 3>; ///< The value, d/dy and d/dz.
    using Range = SplineLattice::Range;

    template <class T>
    static void run(size_t from, size_t end, const SplineLattice& lattice, const Matrix3& A,
                    LatticeJets<NumberOf<T>, Order>& jets) {
        constexpr size_t kCount{kLanes<T>};
        const auto& [x, y, z] = lattice.axes();
        std::vector<Line<T>> lines(4 * x.reach()); // of the last four coefficients along y: [y & 3][x]
        std::vector<Plane<T>> planes(x.reach());
        const size_t line = z.base.size();
        for (size_t next = from; next < end; next += kCount) {
            const size_t begin = std::min(next, end - kCount); // the last lanes may overlap those before
            std::array<const float*, kCount> first;
            alignas(64) std::array<double, kCount> fraction;
            for (size_t k = 0; k < kCount; ++k) {
                first[k] = lattice.coefficients() + lattice.inRow(begin + k);
                fraction[k] = z.fraction[begin + k];
            }
            AxisWeights<T, Order> w;
            for (size_t d = 0; d <= Order; ++d)
                w[d] = cubicBSplineWeights(convertTo<T>(load<Rebind<T, double>>(fraction.data())), static_cast<int>(d));
            size_t done = 0; // coefficients along y whose lines are computed
            for (size_t j = 0; j < jets.y().size(); ++j) {
                const Range positions = lattice.positionsInBand(j, begin, kCount);
                if (positions.empty()) continue;
                const size_t row = y.from(j);
                for (done = std::max(done, row); done < row + 4; ++done) {
                    const Range needed = lattice.coefficientsInBand(done, begin, kCount);
                    for (size_t i = needed.begin; i < needed.end; ++i)
                        lines[(done & 3) * x.reach() + i] =
                            lineOf(fourFrom<T>(first.data(), i * lattice.step()[0] + done * lattice.step()[1]), w);
                }
                const Range needed = x.coefficientsOf(positions);
                for (size_t i = needed.begin; i < needed.end; ++i) {
                    Plane<T> plane{};
                    for (size_t n = 0; n < 4; ++n)
                        addLine(lines[((row + n) & 3) * x.reach() + i], jets.y()[j], n, plane);
                    planes[i] = plane;
                }
                for (size_t i = positions.begin; i < positions.end; ++i) {
                    const auto jet = pullBack(sumOf(&planes[x.from(i)], jets.x()[i]), A);
                    const size_t to = (i * jets.y().size() + j) * line + begin;
                    for (int k = 0; k < jet.kSize; ++k)
                        store(jet.component(k), jets.component(static_cast<size_t>(k)) + to);
                }
            }
        }
    }

  private:
    template <class T>
    static Line<T> lineOf(const std::array<T, 4>& c, const AxisWeights<T, Order>& w) {
        Line<T> line;
        for (size_t d = 0; d <= Order; ++d) {
            T sum = c[0] * w[d][0];
            for (size_t n = 1; n < 4; ++n) sum = mulAdd(c[n], w[d][n], sum);
            line[d] = sum;
        }
        return line;
    }
    /// Adds a line with the weights of its coefficient n.
    template <class T, class Number>
    static void addLine(const Line<T>& line, const AxisWeights<Number, Order>& w, size_t n, Plane<T>& plane) {
        plane[0] = mulAdd(line[0], T(w[0][n]), plane[0]);
        if constexpr (Order == 1) {
            plane[1] = mulAdd(line[0], T(w[1][n]), plane[1]);
            plane[2] = mulAdd(line[1], T(w[0][n]), plane[2]);
        }
    }
    template <class T, class Number>
    static Jet<T, 3, Order> sumOf(const Plane<T>* planes, const AxisWeights<Number, Order>& w) {
        Jet<T, 3, Order> jet(T(0));
        for (size_t n = 0; n < 4; ++n) {
            jet.value = mulAdd(planes[n][0], T(w[0][n]), jet.value);
            if constexpr (Order == 1) {
                jet.gradient[0] = mulAdd(planes[n][0], T(w[1][n]), jet.gradient[0]);
                jet.gradient[1] = mulAdd(planes[n][1], T(w[0][n]), jet.gradient[1]);
                jet.gradient[2] = mulAdd(planes[n][2], T(w[0][n]), jet.gradient[2]);
            }
        }
        return jet;
    }
};

} // namespace curlew
