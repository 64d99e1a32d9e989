// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Advect.h"
#include "curlew/track/Points.h"

#include <optional>

namespace curlew {

// Curl-noise jittering (Baerentzen, Frisvad and Martinez 2023; ICN §5.1): the points of a lattice, each moved a little
// along a flow of noise, are irregular and yet well spaced. N = 2 … 7.

/// How far a point of a cubic lattice is, in the mean, from its 3^n - 1 neighbours, in spacings (ICN §5.1). Throws
/// ValueError for n < 1.
double meanNeighbourDistance(int n);

/// The points of the domain on the cubic lattice that has, along each axis, as many whole cells in the box as come
/// nearest to its size, at least one; they are the cells' centres, the lattice is centred in the box, and its first
/// axis runs fastest. Throws ValueError for an infinite domain and a spacing that is not positive, ResourceError for
/// too many points.
template <int N>
std::vector<Vec<double, N>> latticePoints(const DomainN<N>& domain, double spacing, const Monitor& monitor = {});

struct JitterFlowOptions {
    uint64_t seed = 0;
    double frequency = 0.3; ///< Of the noise, cycles per spacing.
    /// c / |c| instead of c (DeWolf §5): all points move about equally far. In more than 3 dimensions |c|, a product of
    /// N - 1 gradients, is so uneven that otherwise most points hardly move and a few go far. Not divergence-free.
    bool uniform = true;
    /// A moment, seconds, of an animated flow, which is a slice through noises of one dimension more and passes a cell
    /// of them each second: N = 2 … 6.
    std::optional<double> time = {};
};

/// The flow of N - 1 independent simplex noises, of rms speed 1 in the domain's box. Where the domain has a wall, the
/// last of them is bounded by it (ICN Eq. 13 and Fig. 8). Throws ValueError for a spacing or frequency that is not
/// positive, and for a time in 7 dimensions.
template <int N>
FlowN<N> jitterFlow(const DomainN<N>& domain, double spacing, const JitterFlowOptions& options = {});

/// Moves points by one RK4 step along a flow of rms speed 1, of the length 0.16 · amount · meanNeighbourDistance(N) ·
/// spacing (docs/math.md tells why 0.16), and puts them back onto their tracks. With a bounded flow no point crosses
/// the wall, and those beyond it stay where they are. Throws as advect().
template <int N>
AdvectResultN<N> jitter(const FlowN<N>& flow, std::vector<Vec<double, N>>& points, double spacing, double amount = 1,
                        const Monitor& monitor = {});

/// Moves points at random, uniformly within a cube of edge amount · spacing around each. Point k depends on the seed
/// and k alone. Throws ValueError for a spacing that is not positive.
template <int N>
void jitterRandomly(std::vector<Vec<double, N>>& points, double spacing, double amount, uint64_t seed);

/// The intersection of a domain in space with the plane z = 0.
DomainN<2> inPlane(const Domain& domain);

struct JitteredLatticeOptions {
    double count = 10000;        ///< About how many points, if no spacing is given.
    double spacing = 0;          ///< Of the lattice, world units; 0: from `count`.
    double amount = 1;           ///< How far points move, as in jitter() and jitterRandomly().
    bool random = false;         ///< By jitterRandomly() instead of a flow.
    bool conform = true;         ///< The flow does not cross the domain's wall.
    double width = 1;            ///< Of the wall's layer, in spacings.
    JitterFlowOptions flow = {}; ///< Its seed is that of jitterRandomly(), too.
};

struct JitteredLattice {
    Points points; ///< With ids in the order of the lattice; those of a plane have z = 0.
    double spacing = 0;
    bool conforms = false; ///< Whether there is a wall that no point crossed.
};

/// The points of the domain on a lattice, jittered. N = 2 or 3. Throws ValueError if no point of the lattice is in the
/// domain, and as the functions above.
template <int N>
JitteredLattice jitteredLattice(DomainN<N> domain, const JitteredLatticeOptions& options, const Monitor& monitor = {});

} // namespace curlew
