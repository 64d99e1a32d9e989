// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/math/Vec.h"

#include <cstddef>
#include <memory>
#include <vector>

namespace curlew {

/// Which points of a set are near each other, in N = 2 … 7 dimensions; by a k-d tree (nanoflann). Refers to the points,
/// which have to stay as they are. Safe to share between threads.
template <int N>
class NeighboursN {
  public:
    /// Throws ValueError for a point that is not at a finite place, ResourceError for too many points, Interrupted once
    /// the monitor says so.
    explicit NeighboursN(const std::vector<Vec<double, N>>& points, const Monitor& monitor = {});
    ~NeighboursN();

    /// From each point, or from every stride-th, how far away the nearest of the others is, world units: 0 where two
    /// points are at the same place, infinite where there is no other.
    std::vector<double> nearestDistances(size_t stride = 1, const Monitor& monitor = {}) const;

    /// Adds to bin k how many points are k to k + 1 widths away from this one, without itself.
    void count(size_t point, double width, std::vector<double>& bins) const;

  private:
    struct Tree;
    std::unique_ptr<const Tree> mTree;
};
using Neighbours = NeighboursN<3>;

/// How far points are from the one that is nearest to each (ICN Table 1), world units.
struct Spacing {
    double median = 0; ///< Of an even number of points, the larger of the two in the middle.
    double minimum = 0;
};

/// Throws ValueError for fewer than two points, and as Neighbours does.
template <int N>
Spacing spacingOf(const std::vector<Vec<double, N>>& points, const Monitor& monitor = {});

/// Of the distances that Neighbours has found. Throws ValueError where there are none.
Spacing spacingOf(std::vector<double> nearestDistances);

} // namespace curlew
