#pragma once

#include "curlew/base/Parallel.h"
#include "curlew/base/Random.h"
#include "curlew/math/Vec.h"

#include <nanoflann.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace curlew::paper {

template <int N>
using Points = std::vector<Vec<double, N>>;

/// Finds the points near a point, by nanoflann's tree. Refers to the points.
template <int N>
class Neighbours {
  public:
    explicit Neighbours(const Points<N>& points) : mCloud{points}, mTree(N, mCloud, {16}) { mTree.buildIndex(); }

    /// From every point, or every stride-th, the distance to the one that is nearest to it.
    std::vector<double> nearestDistances(size_t stride) const {
        std::vector<double> found((mCloud.points.size() + stride - 1) / stride);
        parallelFor(found.size(), 256, [&](size_t begin, size_t end) {
            for (size_t k = begin; k < end; ++k) {
                std::array<uint32_t, 2> index;
                std::array<double, 2> squared;
                mTree.knnSearch(mCloud.points[k * stride].c.data(), 2, index.data(), squared.data());
                found[k] = std::sqrt(squared[1]); // the first is the point itself
            }
        });
        return found;
    }

    /// How many points are how far from point k, counted in bins of this width, without itself.
    void count(size_t k, double width, std::vector<double>& bins) const {
        Counter counter{k, width, width * static_cast<double>(bins.size()), bins};
        mTree.findNeighbors(counter, mCloud.points[k].c.data(), {});
    }

  private:
    struct Cloud {
        const Points<N>& points;
        size_t kdtree_get_point_count() const { return points.size(); }
        double kdtree_get_pt(size_t k, size_t axis) const { return points[k].c[axis]; }
        template <class Box>
        bool kdtree_get_bbox(Box&) const {
            return false;
        }
    };
    struct Counter { // what nanoflann calls a result set
        size_t self;
        double width, reach;
        std::vector<double>& bins;
        bool addPoint(double squared, uint32_t k) {
            const auto bin = static_cast<size_t>(std::sqrt(squared) / width);
            if (k != self && bin < bins.size()) ++bins[bin];
            return true;
        }
        double worstDist() const { return reach * reach; }
        bool full() const { return true; }
    };

    Cloud mCloud;
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Cloud>, Cloud, N, uint32_t> mTree;
};

/// What Table 1 tells of a set of points.
struct Spacing {
    double median = 0;
    double minimum = 0; ///< NaN: not known.
};

/// Of sets of more than `most` points, the median of a sample.
template <int N>
Spacing spacingOf(const Neighbours<N>& neighbours, size_t points, size_t most) {
    const size_t stride =
        points <= most ? 1 : 10 * points / most | 1; // odd: sequences have a structure of powers of two
    auto distances = neighbours.nearestDistances(stride);
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    return {*middle,
            stride == 1 ? *std::min_element(distances.begin(), middle + 1) : std::numeric_limits<double>::quiet_NaN()};
}

/// How many pairs of independent, uniform points of a cube of this edge have a distance up to `radius`, which is not
/// longer than the edge: as a share of all pairs. The mean over directions u of Π(1 - r |u_i| / edge), the part of the
/// cube that overlaps with itself moved by r u, expanded: products of k components of u have the mean
/// π^(-k/2) Γ(n/2) / Γ((n+k)/2); then integrated over the ball.
template <int N>
double shareOfPairsWithin(double radius, double edge) {
    const double r = radius / edge, pi = std::acos(-1.0);
    double sum = 0, choose = 1;
    for (int k = 0; k <= N; ++k) {
        sum += choose * std::pow(-1.0, k) * std::pow(pi, -0.5 * k) / std::tgamma(0.5 * (N + k)) * std::pow(r, N + k) /
               (N + k);
        choose *= static_cast<double>(N - k) / (k + 1);
    }
    return 2 * std::pow(pi, 0.5 * N) * sum;
}

/// The radial distribution function: how many pairs of the points have a distance in each bin, relative to as many
/// independent, uniform points of the cube that they fill. Seen from `most` of the points, chosen at random, or from
/// all. NaN beyond the edge.
template <int N>
std::vector<double> radialDistribution(const Neighbours<N>& neighbours, size_t points, double edge, double width,
                                       size_t bins, size_t most) {
    const size_t seen = std::min(points, most);
    struct Bins {
        std::vector<double> counts;
        Bins& operator+=(const Bins& o) {
            counts.resize(std::max(counts.size(), o.counts.size()));
            for (size_t k = 0; k < o.counts.size(); ++k) counts[k] += o.counts[k];
            return *this;
        }
    };
    std::vector<double> found =
        parallelSum(seen, 16, [&](size_t begin, size_t end) {
            Bins part{std::vector<double>(bins)};
            for (size_t k = begin; k < end; ++k)
                neighbours.count(seen < points ? randomBits(0, k) % points : k, width, part.counts);
            return part;
        }).counts;
    const double pairs = static_cast<double>(seen) * static_cast<double>(points - 1);
    for (size_t k = 0; k < bins; ++k) {
        const auto at = static_cast<double>(k);
        if (width * (at + 1) > edge) found[k] = std::numeric_limits<double>::quiet_NaN();
        found[k] /= pairs * (shareOfPairsWithin<N>(width * (at + 1), edge) - shareOfPairsWithin<N>(width * at, edge));
    }
    return found;
}

} // namespace curlew::paper
