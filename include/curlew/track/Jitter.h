// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Advect.h"
#include "curlew/track/Points.h"

#include <optional>

namespace curlew {

// Curl-noise jittering (Baerentzen, Frisvad and Martinez 2023; ICN §5.1) moves each point of a lattice a little along a
// noise flow. The result is irregular but well spaced. N = 2 … 7.

/// Returns the mean distance from a point of a cubic lattice to its 3^n - 1 neighbours, in spacings (ICN §5.1). Throws
/// ValueError if n < 1.
double meanNeighbourDistance(int n);

/// Returns the points of a cubic lattice that lie in the domain. Along each axis the lattice has the whole number of
/// cells, at least one, that comes nearest to the box's size. The points are the cells' centres, the lattice is centred
/// in the box, and its first axis runs fastest. Throws ValueError if the domain is infinite or the spacing is not
/// positive, ResourceError if there are too many points.
template <int N>
std::vector<Vec<double, N>> latticePoints(const DomainN<N>& domain, double spacing, const Monitor& monitor = {});

struct JitterFlowOptions {
    uint64_t seed = 0;
    double frequency = 0.3; ///< Frequency of the noise, cycles per spacing.
    /// Uses c / |c| instead of c (DeWolf §5), so all points move about equally far. In more than 3 dimensions |c|, a
    /// product of N - 1 gradients, is so uneven that most points would hardly move and a few would move far. Not
    /// divergence-free.
    bool uniform = true;
    /// Time, seconds, of an animated flow. The flow is a slice through noises of one dimension more and passes one of
    /// their cells per second. N = 2 … 6.
    std::optional<double> time = {};
};

/// Returns the flow of N - 1 independent simplex noises, of rms speed 1 in the domain's box. If the domain has a wall,
/// the last noise is bounded by it (ICN Eq. 13 and Fig. 8). Throws ValueError if the spacing or the frequency is not
/// positive, or if a time is given in 7 dimensions.
template <int N>
FlowN<N> jitterFlow(const DomainN<N>& domain, double spacing, const JitterFlowOptions& options = {});

/// Moves points by one RK4 step along a flow of rms speed 1 and reprojects them onto their tracks. The step has the
/// length 0.16 · amount · meanNeighbourDistance(N) · spacing (docs/math.md explains the factor 0.16). If the flow is
/// bounded, no point crosses the wall, and points beyond it stay in place. Throws like advect().
template <int N>
AdvectResultN<N> jitter(const FlowN<N>& flow, std::vector<Vec<double, N>>& points, double spacing, double amount = 1,
                        const Monitor& monitor = {});

/// Moves points at random, uniformly within a cube of edge amount · spacing around each. The move of point k depends
/// only on the seed and k. Throws ValueError if the spacing is not positive.
template <int N>
void jitterRandomly(std::vector<Vec<double, N>>& points, double spacing, double amount, uint64_t seed);

/// Returns the intersection of a 3D domain with the plane z = 0.
DomainN<2> inPlane(const Domain& domain);

struct JitteredLatticeOptions {
    double count = 10000;        ///< Approximate number of points, used if no spacing is given.
    double spacing = 0;          ///< Of the lattice, world units; 0: derived from `count`.
    double amount = 1;           ///< How far points move, as in jitter() and jitterRandomly().
    bool random = false;         ///< Use jitterRandomly() instead of a flow.
    bool conform = true;         ///< The flow does not cross the domain's wall.
    double width = 1;            ///< Of the wall's layer, in spacings.
    JitterFlowOptions flow = {}; ///< Its seed also serves jitterRandomly().
};

template <int N>
struct JitteredPositionsN {
    std::vector<Vec<double, N>> positions; ///< In lattice order.
    double spacing = 0;
    bool conforms = false; ///< Whether the domain has a wall that no point crossed.
};

/// Returns the lattice points of the domain, jittered. Throws ValueError if no lattice point is in the domain, and like
/// the functions above.
template <int N>
JitteredPositionsN<N> jitteredPositions(DomainN<N> domain, const JitteredLatticeOptions& options,
                                        const Monitor& monitor = {});

struct JitteredLattice {
    Points points; ///< With ids in lattice order; z = 0 if N = 2.
    double spacing = 0;
    bool conforms = false; ///< Whether the domain has a wall that no point crossed.
};

/// The same as points. N = 2 or 3.
template <int N>
JitteredLattice jitteredLattice(const DomainN<N>& domain, const JitteredLatticeOptions& options,
                                const Monitor& monitor = {});

} // namespace curlew
