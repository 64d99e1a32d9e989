// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Parallel.h"
#include "curlew/base/Random.h"
#include "curlew/track/Neighbours.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace curlew::paper {

template <int N>
using Positions = std::vector<Vec<double, N>>;

/// Returns the figures of Table 1 for a set of points. For a set with more than `most` points, the median is that of a
/// sample, and the minimum is NaN.
template <int N>
Spacing spacingOf(const NeighboursN<N>& neighbours, size_t points, size_t most) {
    const size_t stride =
        points <= most ? 1 : 10 * points / most | 1; // odd, since the sequences are structured by powers of two
    Spacing spacing = curlew::spacingOf(neighbours.nearestDistances(stride));
    if (stride > 1) spacing.minimum = std::numeric_limits<double>::quiet_NaN();
    return spacing;
}

/// Returns the fraction of pairs of independent, uniform points in a cube with this edge that are at most `radius`
/// apart (radius <= edge). The integrand is the mean over directions u of Π(1 - r |u_i| / edge), the overlap of the
/// cube with itself translated by r u. In its expansion, products of k components of u have the mean π^(-k/2) Γ(n/2) /
/// Γ((n+k)/2); it is then integrated over the ball.
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

/// Returns the radial distribution function: the number of pairs with a distance in each bin, relative to the same
/// number of independent, uniform points in the cube. Counts pairs from `most` randomly chosen points, or from all if
/// there are fewer. NaN beyond the edge.
template <int N>
std::vector<double> radialDistribution(const NeighboursN<N>& neighbours, size_t points, double edge, double width,
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
