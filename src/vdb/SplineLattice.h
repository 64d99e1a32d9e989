// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "SplineContraction.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace curlew {

/// A tricubic B-spline on a lattice, whose axes are those of the spline: sums along z, then y, then x, each of which
/// serves all positions on a line or plane. The operations on each position are those of contractedSpline(), so the
/// bits are the same. Independent of OpenVDB.
class SplineLattice {
  public:
    /// Positions along an axis in voxels of the spline.
    struct Axis {
        std::vector<int> base; ///< The voxel below each position; ascending.
        std::vector<std::array<double, 4>> weights;

        /// Takes a position, and returns whether it is not below the last one.
        bool add(double x) {
            const double below = floor(x);
            if (!(std::abs(x) < VoxelKernel::kNowhere) || (!base.empty() && below < base.back())) return false;
            base.push_back(static_cast<int>(below));
            weights.push_back(cubicBSplineWeights(x - below, 0));
            return true;
        }
        int firstLeaf() const { return base.front() >> 3; }
        /// The number of coefficients from the first to the last.
        size_t reach() const {
            const int count = base.back() - base.front() + 4;
            return static_cast<size_t>(count);
        }
        /// The positions in a leaf.
        std::pair<size_t, size_t> in(int leaf) const {
            const auto from = std::lower_bound(base.begin(), base.end(), leaf * kLeaf);
            const auto to = std::lower_bound(from, base.end(), (leaf + 1) * kLeaf);
            return {static_cast<size_t>(from - base.begin()), static_cast<size_t>(to - base.begin())};
        }
        /// The coefficients in the block of a leaf, relative to the first one of the axis, and where they are in it.
        struct Rows {
            size_t first, count, local;
        };
        Rows rowsOf(int leaf) const {
            const int begin = std::max(leaf * kLeaf - 1, base.front() - 1);
            const int end = std::min(leaf * kLeaf - 1 + kBlock, base.back() + 3);
            return {static_cast<size_t>(begin - (base.front() - 1)), static_cast<size_t>(end - begin),
                    static_cast<size_t>(begin - (leaf * kLeaf - 1))};
        }
    };
    /// The block of coefficients of a leaf; nullptr beyond the band, where the spline is `level`.
    struct Leaf {
        const float* block;
        float level;
    };

    explicit SplineLattice(const std::array<Axis, 3>& axes) : mAxes(axes) {}

    /// Whether this is cheaper than to compute each position by itself.
    bool pays() const {
        const auto& [x, y, z] = mAxes;
        return x.reach() * y.reach() <= 8 * x.base.size() * y.base.size();
    }

    /// `leafAt(i, j, k)` returns a leaf by its coordinates.
    template <class LeafAt>
    void eval(const LeafAt& leafAt, double* values) const {
        const auto& [x, y, z] = mAxes;
        struct Beyond {
            std::array<int, 3> leaf;
            float level;
        };
        std::vector<Beyond> beyond;
        std::vector<double> lines;
        for (int i = x.firstLeaf(); i <= x.base.back() >> 3; ++i)
            for (int j = y.firstLeaf(); j <= y.base.back() >> 3; ++j)
                for (int k = z.firstLeaf(); k <= z.base.back() >> 3; ++k) {
                    const Leaf leaf = leafAt(i, j, k);
                    if (!leaf.block) {
                        beyond.push_back({{i, j, k}, leaf.level});
                        continue;
                    }
                    lines.resize(x.reach() * y.reach() * z.base.size());
                    addLines(leaf.block, {i, j, k}, lines);
                }
        if (!lines.empty()) sumLines(lines, values);
        for (const auto& [leaf, level] : beyond) fill(leaf, static_cast<double>(level), values);
    }

  private:
    static constexpr int kLeaf = SplineContraction::kLeaf, kBlock = SplineContraction::kBlock;

    /// Sums along z all rows of a block, for the positions in its leaf. Lines are [x][y][z], x and y those of
    /// coefficients.
    void addLines(const float* block, const std::array<int, 3>& leaf, std::vector<double>& lines) const {
        const auto& [x, y, z] = mAxes;
        const auto rowsX = x.rowsOf(leaf[0]), rowsY = y.rowsOf(leaf[1]);
        const auto [begin, end] = z.in(leaf[2]);
        for (size_t i = 0; i < rowsX.count; ++i)
            for (size_t j = 0; j < rowsY.count; ++j) {
                const float* coefficients = block + ((rowsX.local + i) * kBlock + rowsY.local + j) * kBlock;
                std::array<double, kBlock> row;
                for (size_t n = 0; n < kBlock; ++n) row[n] = static_cast<double>(coefficients[n]);
                double* line = &lines[((rowsX.first + i) * y.reach() + rowsY.first + j) * z.base.size()];
                for (size_t k = begin; k < end; ++k) {
                    const double* c = &row[static_cast<size_t>(z.base[k] & (kLeaf - 1))];
                    const auto& w = z.weights[k];
                    double sum = c[0] * w[0];
                    for (size_t n = 1; n < 4; ++n) sum = mulAdd(c[n], w[n], sum);
                    line[k] = sum;
                }
            }
    }

    void sumLines(const std::vector<double>& lines, double* values) const {
        const auto& [x, y, z] = mAxes;
        const size_t row = z.base.size(), plane = y.base.size() * row;
        std::vector<double> planes(x.reach() * plane);
        for (size_t i = 0; i < x.reach(); ++i)
            for (size_t j = 0; j < y.base.size(); ++j) {
                const auto from = static_cast<size_t>(y.base[j] - y.base.front());
                sumFour(&lines[(i * y.reach() + from) * row], row, y.weights[j], row, &planes[i * plane + j * row]);
            }
        for (size_t i = 0; i < x.base.size(); ++i) {
            const auto from = static_cast<size_t>(x.base[i] - x.base.front());
            sumFour(&planes[from * plane], plane, x.weights[i], plane, values + i * plane);
        }
    }

    /// Sums four rows of `count` numbers, `step` apart.
    static void sumFour(const double* rows, size_t step, const std::array<double, 4>& w, size_t count,
                        double* __restrict sums) {
        const double *a = rows, *b = a + step, *c = b + step, *d = c + step;
        for (size_t k = 0; k < count; ++k)
            sums[k] = mulAdd(d[k], w[3], mulAdd(c[k], w[2], mulAdd(b[k], w[1], mulAdd(a[k], w[0], 0.0))));
    }

    void fill(const std::array<int, 3>& leaf, double level, double* values) const {
        std::array<std::pair<size_t, size_t>, 3> in;
        for (size_t axis = 0; axis < 3; ++axis) in[axis] = mAxes[axis].in(leaf[axis]);
        for (size_t i = in[0].first; i < in[0].second; ++i)
            for (size_t j = in[1].first; j < in[1].second; ++j) {
                double* row = values + (i * mAxes[1].base.size() + j) * mAxes[2].base.size();
                std::fill(row + in[2].first, row + in[2].second, level);
            }
    }

    const std::array<Axis, 3>& mAxes;
};

} // namespace curlew
