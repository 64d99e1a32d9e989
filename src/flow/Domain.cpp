// SPDX-License-Identifier: Apache-2.0
#include "curlew/flow/Domain.h"

#include "Samples.h"
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/Dimensions.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

namespace curlew {

template <int N>
DomainN<N> DomainN<N>::of(const WallN<N>& wall, double padding) {
    DomainN domain{.wall = wall};
    if (!wall.sdf.bounds.finite()) return domain;
    domain.box = wall.sdf.bounds;
    if (wall.side == Side::inside) return domain;
    const auto size = domain.box.size();
    domain.box = domain.box.padded(padding < 0 ? 0.5 * *std::max_element(size.c.begin(), size.c.end()) : padding);
    return domain;
}

double beyondWall(Side side, double distance) {
    switch (side) {
        case Side::inside:
            return distance;
        case Side::outside:
            return -distance;
        case Side::both:
            break;
    }
    return -std::abs(distance);
}

template <int N>
void classify(const DomainN<N>& domain, const PointBatchN<N>& points, std::array<bool, kBatch>& allowed,
              std::array<double, kBatch>& distance) {
    if (!domain.wall) {
        allowed.fill(true);
        distance.fill(std::numeric_limits<double>::infinity());
        return;
    }
    JetBatchN<double, N, 0> d;
    domain.wall->sdf.distance.eval(points, d);
    for (int i = 0; i < points.size; ++i) {
        const auto k = static_cast<size_t>(i);
        double size = 0;
        for (const auto& axis : points.c) size += std::abs(axis[k]);
        distance[k] = d.c[0][k];
        allowed[k] = beyondWall(domain.wall->side, distance[k]) < -kPositionRounding * size;
    }
}

#define CURLEW_INSTANTIATE(N)                                                                   \
    template struct DomainN<N>;                                                                 \
    template void classify(const DomainN<N>&, const PointBatchN<N>&, std::array<bool, kBatch>&, \
                           std::array<double, kBatch>&);
CURLEW_FOR_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

double volumeOf(const Domain& domain) {
    constexpr size_t kSamples = 8192;
    size_t inside = 0;
    visitSamples(domain, 0, kSamples, [&](const PointBatch& points) { inside += static_cast<size_t>(points.size); });
    const Vec3d size = domain.box.size();
    return size[0] * size[1] * size[2] * static_cast<double>(inside) / static_cast<double>(kSamples);
}

namespace {

using Cells = std::vector<Vec<int, 3>>; ///< In lexicographic order.

/// Returns the first cell whose index along the axis is not that of `first`.
Cells::const_iterator nextAlong(int axis, Cells::const_iterator first, Cells::const_iterator end) {
    return std::find_if(first, end, [&](const auto& cell) { return cell[axis] != (*first)[axis]; });
}

/// Returns the halves along each axis of cells that have the same first index.
Cells childrenOf(Cells::const_iterator begin, Cells::const_iterator end) {
    Cells children;
    children.reserve(8 * static_cast<size_t>(end - begin));
    for (const int i : {0, 1})
        for (auto row = begin, next = row; row != end; row = next) {
            next = nextAlong(1, row, end);
            for (const int j : {0, 1})
                for (auto cell = row; cell != next; ++cell)
                    for (const int k : {0, 1})
                        children.push_back({{2 * (*cell)[0] + i, 2 * (*cell)[1] + j, 2 * (*cell)[2] + k}});
        }
    return children;
}

/// Finds the cells of a lattice level by level, from cells of edge size 2^level to those of edge size.
class CellSearch {
  public:
    CellSearch(const Domain& domain, const Vec3d& origin, double size, const DistanceRange& range, size_t limit)
        : mDomain(domain), mOrigin(origin), mSize(size), mRange(range), mLimit(limit) {}

    Cells run() const {
        auto [cells, level] = coarsest();
        cells = needed(cells, level);
        while (level > 0) cells = refined(cells, --level);
        requireFew(cells);
        return std::move(cells);
    }

  private:
    struct Level {
        Cells cells;
        int level = 0;
    };

    /// Returns all cells in the box at the finest level that has no more of them than a batch.
    Level coarsest() const {
        Vec<int, 3> lower, upper;
        for (int level = 0;; ++level) {
            double count = 1;
            for (int axis = 0; axis < 3; ++axis) {
                const double edge = std::ldexp(mSize, level);
                const double first = std::floor((mDomain.box.lower[axis] - mOrigin[axis]) / edge);
                const double last = std::floor((mDomain.box.upper[axis] - mOrigin[axis]) / edge);
                if (std::max(std::abs(first), std::abs(last)) * std::ldexp(1, level) > 0x1p30)
                    throw ValueError(fmt::format(
                        "cells of {} world units are too small for a domain of {:.6g}; choose larger voxels", mSize,
                        mDomain.box.size()[axis]));
                count *= last - first + 1;
                lower[axis] = static_cast<int>(first);
                upper[axis] = static_cast<int>(last);
            }
            if (count > kBatch) continue;
            Level top{.cells = {}, .level = level};
            for (int i = lower[0]; i <= upper[0]; ++i)
                for (int j = lower[1]; j <= upper[1]; ++j)
                    for (int k = lower[2]; k <= upper[2]; ++k) top.cells.push_back({{i, j, k}});
            return top;
        }
    }

    /// Returns the needed children of the cells. Divides one layer of cells at a time, which bounds the memory.
    Cells refined(const Cells& cells, int level) const {
        constexpr size_t kSmall = size_t{1} << 20; // for so few, room for all children costs less than growing does
        Cells found;
        if (const size_t most = 8 * cells.size(); most <= kSmall) found.reserve(most);
        for (auto layer = cells.begin(), next = layer; layer != cells.end(); layer = next) {
            next = nextAlong(0, layer, cells.end());
            const Cells more = needed(childrenOf(layer, next), level);
            found.insert(found.end(), more.begin(), more.end());
            if (level == 0) requireFew(found);
        }
        return found;
    }

    /// Returns the cells that meet the box and may hold points within the range of distances.
    Cells needed(const Cells& cells, int level) const {
        const double edge = std::ldexp(mSize, level);
        const double radius = (mDomain.wall ? mDomain.wall->sdf.lipschitz : 1) * edge * std::numbers::sqrt3 / 2;
        std::vector<char> keep(cells.size());
        parallelFor(cells.size(), kBatch, [&](size_t begin, size_t end) {
            PointBatch centers;
            for (size_t k = begin; k < end; ++k) centers.push(boxOf(cells[k], edge).center());
            for (size_t k = begin; k < end; ++k) keep[k] = meetsBox(boxOf(cells[k], edge)) ? 1 : 0;
            if (!mDomain.wall) return;
            JetBatch<double, 0> d;
            mDomain.wall->sdf.distance.eval(centers, d);
            for (size_t k = begin; k < end; ++k)
                if (const double distance = d.c[0][k - begin];
                    !(distance > mRange.lower - radius && distance < mRange.upper + radius))
                    keep[k] = false;
        });
        Cells found;
        found.reserve(static_cast<size_t>(std::count(keep.begin(), keep.end(), 1)));
        for (size_t k = 0; k < cells.size(); ++k)
            if (keep[k]) found.push_back(cells[k]);
        return found;
    }

    Box boxOf(const Vec<int, 3>& cell, double edge) const {
        const Vec3d lower = mOrigin + Vec3d{{cell[0] * edge, cell[1] * edge, cell[2] * edge}};
        return {lower, lower + Vec3d{{edge, edge, edge}}};
    }

    bool meetsBox(const Box& cell) const {
        for (int axis = 0; axis < 3; ++axis)
            if (cell.upper[axis] < mDomain.box.lower[axis] || cell.lower[axis] > mDomain.box.upper[axis]) return false;
        return true;
    }

    void requireFew(const Cells& cells) const {
        if (cells.size() > mLimit)
            throw ResourceError(fmt::format("the domain has more than {} cells of {} world units; choose larger voxels",
                                            mLimit, mSize));
    }

    const Domain& mDomain;
    Vec3d mOrigin;
    double mSize;
    DistanceRange mRange;
    size_t mLimit;
};

} // namespace

std::vector<Vec<int, 3>> coveringCells(const Domain& domain, const Vec3d& origin, double size,
                                       const DistanceRange& range, size_t limit) {
    if (!(size > 0) || !std::isfinite(size))
        throw ValueError(fmt::format("the cell size, {} world units, must be positive and finite", size));
    if (!domain.box.finite()) throw ValueError("the domain is infinite and cannot be divided into cells; give a box");
    return CellSearch(domain, origin, size, range, limit).run();
}

} // namespace curlew
