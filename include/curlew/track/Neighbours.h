// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/math/Vec.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace curlew {

/// Neighbour queries on a set of points in N = 2 … 7 dimensions, by a k-d tree (nanoflann). Holds a reference to the
/// points, which must not change. Safe to share between threads.
template <int N>
class NeighboursN {
  public:
    /// Throws ValueError if a position is not finite, ResourceError if there are too many points, Interrupted on
    /// cancellation.
    explicit NeighboursN(const std::vector<Vec<double, N>>& points, const Monitor& monitor = {});
    ~NeighboursN();

    /// Returns the distance from each point, or from every stride-th point, to the nearest other point, world units: 0
    /// if two points coincide, infinite if there is no other point.
    std::vector<double> nearestDistances(size_t stride = 1, const Monitor& monitor = {}) const;

    /// Returns the index of the point nearest to each position. If several are equally near, returns one of them.
    /// Throws ValueError if there are no points.
    std::vector<uint32_t> nearest(const std::vector<Vec<double, N>>& positions, const Monitor& monitor = {}) const;

    /// Adds to bin k the number of points at a distance of k to k + 1 widths from this point, without the point itself.
    void count(size_t point, double width, std::vector<double>& bins) const;

  private:
    struct Tree;
    std::unique_ptr<const Tree> mTree;
};
using Neighbours = NeighboursN<3>;

/// Distances from points to their nearest neighbours (ICN Table 1), world units.
struct Spacing {
    double median = 0; ///< For an even number of points, the larger of the two middle values.
    double minimum = 0;
};

/// Throws ValueError if there are fewer than two points, and like Neighbours.
template <int N>
Spacing spacingOf(const std::vector<Vec<double, N>>& points, const Monitor& monitor = {});

/// The same from distances that Neighbours returned. Throws ValueError if there are none.
Spacing spacingOf(std::vector<double> nearestDistances);

} // namespace curlew
