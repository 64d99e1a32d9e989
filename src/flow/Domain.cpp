// SPDX-License-Identifier: Apache-2.0
#include "curlew/flow/Domain.h"

#include "Samples.h"
#include "curlew/base/Error.h"
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

class CellSearch {
  public:
    CellSearch(const Domain& domain, const Vec3d& origin, double size, const DistanceRange& range, size_t limit)
        : mDomain(domain), mOrigin(origin), mSize(size), mRange(range), mLimit(limit) {}

    std::vector<Vec<int, 3>> run() {
        int level = 0;
        Vec<int, 3> lower, upper;
        for (;; ++level) {
            double cells = 1;
            for (int axis = 0; axis < 3; ++axis) {
                const double edge = std::ldexp(mSize, level);
                const double first = std::floor((mDomain.box.lower[axis] - mOrigin[axis]) / edge);
                const double last = std::floor((mDomain.box.upper[axis] - mOrigin[axis]) / edge);
                if (std::max(std::abs(first), std::abs(last)) * std::ldexp(1, level) > 0x1p30)
                    throw ValueError(fmt::format(
                        "cells of {} world units are too small for a domain of {:.6g}; choose larger voxels", mSize,
                        mDomain.box.size()[axis]));
                cells *= last - first + 1;
                lower[axis] = static_cast<int>(first);
                upper[axis] = static_cast<int>(last);
            }
            if (cells <= kBatch) break;
        }
        std::vector<Vec<int, 3>> top;
        for (int i = lower[0]; i <= upper[0]; ++i)
            for (int j = lower[1]; j <= upper[1]; ++j)
                for (int k = lower[2]; k <= upper[2]; ++k) top.push_back({{i, j, k}});
        visit(top, level);
        std::sort(mFound.begin(), mFound.end(), [](const auto& a, const auto& b) { return a.c < b.c; });
        return std::move(mFound);
    }

  private:
    double lipschitz() const { return mDomain.wall ? mDomain.wall->sdf.lipschitz : 1; }

    Box boxOf(const Vec<int, 3>& cell, double edge) const {
        const Vec3d lower = mOrigin + Vec3d{{cell[0] * edge, cell[1] * edge, cell[2] * edge}};
        return {lower, lower + Vec3d{{edge, edge, edge}}};
    }

    bool meetsBox(const Box& cell) const {
        for (int axis = 0; axis < 3; ++axis)
            if (cell.upper[axis] < mDomain.box.lower[axis] || cell.lower[axis] > mDomain.box.upper[axis]) return false;
        return true;
    }

    /// Descends into the cells of one level that may be needed.
    void visit(const std::vector<Vec<int, 3>>& cells, int level) {
        const double edge = std::ldexp(mSize, level);
        PointBatch centers;
        std::array<Vec<int, 3>, kBatch> found;
        for (const auto& cell : cells)
            if (const Box box = boxOf(cell, edge); meetsBox(box)) {
                found[static_cast<size_t>(centers.size)] = cell;
                centers.push(box.center());
            }
        JetBatch<double, 0> d;
        if (mDomain.wall) mDomain.wall->sdf.distance.eval(centers, d);
        const double radius = lipschitz() * edge * std::numbers::sqrt3 / 2;
        for (size_t k = 0; k < static_cast<size_t>(centers.size); ++k) {
            if (mDomain.wall && !(d.c[0][k] > mRange.lower - radius && d.c[0][k] < mRange.upper + radius)) continue;
            if (level == 0)
                keep(found[k]);
            else
                visit(childrenOf(found[k]), level - 1);
        }
    }

    static std::vector<Vec<int, 3>> childrenOf(const Vec<int, 3>& cell) {
        std::vector<Vec<int, 3>> children(8);
        for (int child = 0; child < 8; ++child)
            children[static_cast<size_t>(child)] = {
                {2 * cell[0] + (child & 1), 2 * cell[1] + ((child >> 1) & 1), 2 * cell[2] + (child >> 2)}};
        return children;
    }

    void keep(const Vec<int, 3>& cell) {
        if (mFound.size() >= mLimit)
            throw ResourceError(fmt::format("the domain has more than {} cells of {} world units; choose larger voxels",
                                            mLimit, mSize));
        mFound.push_back(cell);
    }

    const Domain& mDomain;
    Vec3d mOrigin;
    double mSize;
    DistanceRange mRange;
    size_t mLimit;
    std::vector<Vec<int, 3>> mFound;
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
