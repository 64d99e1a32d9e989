#include "curlew/flow/Domain.h"

#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <algorithm>

namespace curlew {

Domain Domain::of(const Wall& wall, double padding) {
    Domain domain{.wall = wall};
    if (!wall.sdf.bounds.finite()) return domain;
    domain.box = wall.sdf.bounds;
    if (wall.side == Side::inside) return domain;
    const auto size = domain.box.size();
    domain.box = domain.box.padded(padding < 0 ? 0.5 * std::max({size[0], size[1], size[2]}) : padding);
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

void classify(const Domain& domain, const PointBatch& points, std::array<bool, kBatch>& allowed,
              std::array<double, kBatch>& distance) {
    if (!domain.wall) {
        allowed.fill(true);
        distance.fill(std::numeric_limits<double>::infinity());
        return;
    }
    JetBatch<double, 0> d;
    domain.wall->sdf.distance.eval(points, d);
    for (int i = 0; i < points.size; ++i) {
        const auto k = static_cast<size_t>(i);
        const Vec3d p = points[i];
        const double rounding = 0x1p-23 * (std::abs(p[0]) + std::abs(p[1]) + std::abs(p[2]));
        distance[k] = d.c[0][k];
        allowed[k] = beyondWall(domain.wall->side, distance[k]) < -rounding;
    }
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
            if (cells <= 64) break;
        }
        for (int i = lower[0]; i <= upper[0]; ++i)
            for (int j = lower[1]; j <= upper[1]; ++j)
                for (int k = lower[2]; k <= upper[2]; ++k) visit({{i, j, k}}, level);
        std::sort(mFound.begin(), mFound.end(), [](const auto& a, const auto& b) { return a.c < b.c; });
        return std::move(mFound);
    }

  private:
    Box boxOf(const Vec<int, 3>& cell, double edge) const {
        const Vec3d lower = mOrigin + Vec3d{{cell[0] * edge, cell[1] * edge, cell[2] * edge}};
        return {lower, lower + Vec3d{{edge, edge, edge}}};
    }

    bool matters(const Box& cell) const {
        for (int axis = 0; axis < 3; ++axis)
            if (cell.upper[axis] < mDomain.box.lower[axis] || cell.lower[axis] > mDomain.box.upper[axis]) return false;
        if (!mDomain.wall) return true;
        // A distance changes by at most the distance travelled; a sampled one by a little more.
        const double radius = 1.1 * length(cell.size()) / 2;
        const double d = mDomain.wall->sdf.distance.at<0>(cell.center()).value;
        return d > mRange.lower - radius && d < mRange.upper + radius;
    }

    void visit(const Vec<int, 3>& cell, int level) {
        if (!matters(boxOf(cell, std::ldexp(mSize, level)))) return;
        if (level == 0) {
            if (mFound.size() >= mLimit)
                throw ResourceError(fmt::format(
                    "the domain has more than {} cells of {} world units; choose larger voxels", mLimit, mSize));
            mFound.push_back(cell);
            return;
        }
        for (int child = 0; child < 8; ++child)
            visit({{2 * cell[0] + (child & 1), 2 * cell[1] + ((child >> 1) & 1), 2 * cell[2] + (child >> 2)}},
                  level - 1);
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
        throw ValueError(fmt::format("cells of {} world units: the size must be positive and finite", size));
    if (!domain.box.finite()) throw ValueError("an infinite domain has no cells; give a box");
    return CellSearch(domain, origin, size, range, limit).run();
}

} // namespace curlew
