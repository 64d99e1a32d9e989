// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/Neighbours.h"

#include "curlew/base/Error.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/Dimensions.h"

#include <fmt/format.h>
#include <nanoflann.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace curlew {

namespace {

template <int N>
using Positions = std::vector<Vec<double, N>>;

constexpr size_t kLeaf = 16;            // points
constexpr double kBytesPerPoint = 48;   // tree and results
constexpr size_t kMaxPoints = 1u << 31; // indices are 32 bits

/// A result set of nanoflann: it receives each point within worstDist() and returns whether to continue.
struct ResultSet {
    using DistanceType = double; // nanoflann 1.5 and later ask for these names
    using IndexType = uint32_t;
    void sort() {}
    bool full() const { return true; }
};

/// Finds the nearest point except `self`. Stops at distance 0, so that many coincident points take no extra time.
struct Nearest : ResultSet {
    explicit Nearest(size_t excluded = kMaxPoints) : self(excluded) {}
    size_t self;
    uint32_t index = 0;
    double squared = std::numeric_limits<double>::infinity();

    bool addPoint(double found, uint32_t k) {
        if (k != self && found < squared) {
            squared = found;
            index = k;
        }
        return squared > 0;
    }
    double worstDist() const { return squared; }
};

struct Counter : ResultSet {
    Counter(size_t point, double binWidth, std::vector<double>& counts)
        : self(point), width(binWidth), reach(binWidth * static_cast<double>(counts.size())), bins(counts) {}
    size_t self;
    double width, reach;
    std::vector<double>& bins;

    bool addPoint(double squared, uint32_t k) {
        const auto bin = static_cast<size_t>(std::sqrt(squared) / width);
        if (k != self && bin < bins.size()) ++bins[bin];
        return true;
    }
    double worstDist() const { return reach * reach; }
};

/// The member's name has changed with nanoflann 1.5.
template <class Index>
const std::vector<uint32_t>& orderOf(const Index& index) {
    if constexpr (requires { index.vAcc_; })
        return index.vAcc_;
    else
        return index.vAcc;
}

template <int N>
void validate(const Positions<N>& points) {
    if (points.size() > kMaxPoints)
        throw ResourceError(fmt::format("{} points are too many; give at most {}", points.size(), kMaxPoints));
    requireMemory(kBytesPerPoint * static_cast<double>(points.size()),
                  fmt::format("a tree of {} points", points.size()), "give fewer");
    for (size_t k = 0; k < points.size(); ++k)
        if (!std::all_of(points[k].c.begin(), points[k].c.end(), [](double x) { return std::isfinite(x); }))
            throw ValueError(fmt::format("point {} has a position that is not finite", k));
}

} // namespace

template <int N>
struct NeighboursN<N>::Tree {
    struct Cloud {
        const Positions<N>& points;
        const Monitor* monitor = nullptr; ///< Set while one thread builds the tree.
        mutable size_t looked = 0;
        // NOLINTBEGIN(readability-identifier-naming): nanoflann's names for them
        size_t kdtree_get_point_count() const { return points.size(); }
        double kdtree_get_pt(size_t k, size_t axis) const {
            if (monitor && ++looked % (size_t(1) << 20) == 0) monitor->check();
            return points[k].c[axis];
        }
        template <class Box>
        bool kdtree_get_bbox(Box&) const {
            return false;
        }
        // NOLINTEND(readability-identifier-naming)
    };

    Tree(const Positions<N>& points, const Monitor& monitor)
        : cloud{points, &monitor},
          index(N, cloud, {kLeaf, nanoflann::KDTreeSingleIndexAdaptorFlags::SkipInitialBuildIndex}) {
        index.buildIndex();
        cloud.monitor = nullptr;
    }

    template <class Found>
    void search(const Vec<double, N>& position, Found& found) const {
        index.findNeighbors(found, position.c.data(), {});
    }
    template <class Found>
    void search(size_t point, Found& found) const {
        search(cloud.points[point], found);
    }

    /// The points in the order of the tree's leaves.
    const std::vector<uint32_t>& order() const { return orderOf(index); }

    Cloud cloud;
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Cloud>, Cloud, N, uint32_t> index;
};

template <int N>
NeighboursN<N>::NeighboursN(const Positions<N>& points, const Monitor& monitor) {
    validate<N>(points);
    mTree = std::make_unique<const Tree>(points, monitor);
}

template <int N>
NeighboursN<N>::~NeighboursN() = default;

template <int N>
std::vector<double> NeighboursN<N>::nearestDistances(size_t stride, const Monitor& monitor) const {
    if (stride == 0) throw ValueError("a stride of 0 points; give 1 or more");
    std::vector<double> distances((mTree->cloud.points.size() + stride - 1) / stride);
    // In the tree's order, so that consecutive searches visit memory that is still in the cache.
    const auto& order = mTree->order();
    parallelFor(
        order.size(), 1024,
        [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; ++i) {
                if (order[i] % stride != 0) continue;
                Nearest nearest(order[i]);
                mTree->search(order[i], nearest);
                distances[order[i] / stride] = std::sqrt(nearest.squared);
            }
        },
        monitor);
    return distances;
}

template <int N>
std::vector<uint32_t> NeighboursN<N>::nearest(const Positions<N>& positions, const Monitor& monitor) const {
    if (mTree->cloud.points.empty()) throw ValueError("there are no points, so none is nearest");
    std::vector<uint32_t> indices(positions.size());
    parallelFor(
        positions.size(), 256,
        [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; ++i) {
                Nearest nearest;
                mTree->search(positions[i], nearest);
                indices[i] = nearest.index;
            }
        },
        monitor);
    return indices;
}

template <int N>
void NeighboursN<N>::count(size_t point, double width, std::vector<double>& bins) const {
    Counter counter(point, width, bins);
    mTree->search(point, counter);
}

template <int N>
Spacing spacingOf(const Positions<N>& points, const Monitor& monitor) {
    if (points.size() < 2)
        throw ValueError(fmt::format("nearest neighbours need at least 2 points, not {}", points.size()));
    return spacingOf(NeighboursN<N>(points, monitor).nearestDistances(1, monitor));
}

Spacing spacingOf(std::vector<double> nearestDistances) {
    if (nearestDistances.empty()) throw ValueError("no distances are given, so there is no median");
    const auto middle = nearestDistances.begin() + static_cast<std::ptrdiff_t>(nearestDistances.size() / 2);
    std::nth_element(nearestDistances.begin(), middle, nearestDistances.end());
    return {.median = *middle, .minimum = *std::min_element(nearestDistances.begin(), middle + 1)};
}

#define CURLEW_INSTANTIATE(N)      \
    template class NeighboursN<N>; \
    template Spacing spacingOf(const Positions<N>&, const Monitor&);
CURLEW_FOR_FLOW_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
