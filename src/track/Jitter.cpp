// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/Jitter.h"

#include "curlew/base/Memory.h"
#include "curlew/base/Random.h"
#include "curlew/base/Require.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Dimensions.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/field/NoiseField.h"

#include <algorithm>
#include <utility>

namespace curlew {

namespace {

template <int N>
using Positions = std::vector<Vec<double, N>>;

constexpr double kStep = 0.16; // relative to the mean distance to the neighbours

/// Returns one potential of the flow, independent of the others.
template <int N>
ScalarFieldN<N> noiseOf(size_t potential, double spacing, const JitterFlowOptions& o) {
    const OctaveOptions octaves{.frequency = o.frequency / spacing};
    const SimplexOptions noise{.seed = randomBits(o.seed, potential)};
    if (!o.time) return noiseField<SimplexNoise<N>>(noise, octaves);
    if constexpr (N < 7)
        return lifted<N>(noiseField<SimplexNoise<N + 1>>(noise, octaves),
                         {constantField<N>(*o.time / octaves.frequency)});
    else
        throw ValueError(
            "a flow in 7 dimensions cannot change with time: that needs noise in 8 dimensions, which is not available");
}

/// Returns the spacing at which the lattice has about `count` points in the domain.
template <int N>
double spacingFor(const DomainN<N>& domain, double count, const Monitor& monitor) {
    double volume = 1;
    for (int axis = 0; axis < N; ++axis) volume *= domain.box.size()[axis];
    const double guess = std::pow(volume / count, 1.0 / N);
    const auto found = static_cast<double>(latticePoints(domain, guess, monitor).size());
    if (found == 0) throw ValueError("no lattice point is in the domain; give a larger count");
    return guess * std::pow(found / count, 1.0 / N);
}

} // namespace

double meanNeighbourDistance(int n) {
    if (n < 1) throw ValueError(fmt::format("{} dimensions; give at least 1", n));
    // 2^i (n over i) of the neighbours differ in i coordinates.
    double count = 1, sum = 0, all = 0;
    for (int i = 1; i <= n; ++i) {
        count *= 2.0 * (n - i + 1) / i;
        sum += count * std::sqrt(i);
        all += count;
    }
    return sum / all;
}

template <int N>
Positions<N> latticePoints(const DomainN<N>& domain, double spacing, const Monitor& monitor) {
    requirePositive(spacing, "spacing");
    if (!domain.box.finite()) throw ValueError("the domain is infinite; give a box");
    std::array<size_t, N> cells;
    Vec<double, N> first;
    size_t count = 1;
    double bytes = 4 * sizeof(Vec<double, N>); // in chunks, in one array, and as the points that they become
    for (int axis = 0; axis < N; ++axis) {
        const double size = domain.box.size()[axis];
        if (!(size >= 0)) throw ValueError("the box is empty");
        const double fit = std::max(1.0, std::floor(size / spacing + 0.5));
        bytes *= fit;
        requireMemory(bytes, "the lattice", "choose a larger spacing");
        cells[static_cast<size_t>(axis)] = static_cast<size_t>(fit);
        count *= static_cast<size_t>(fit);
        first[axis] = domain.box.center()[axis] - 0.5 * spacing * (fit - 1);
    }
    const PointsBy lattice{count, [&](size_t k) {
                               Vec<double, N> p = first;
                               for (int axis = 0; axis < N; ++axis) {
                                   const size_t n = cells[static_cast<size_t>(axis)];
                                   p[axis] += spacing * static_cast<double>(k % n);
                                   k /= n;
                               }
                               return p;
                           }};
    // Process the lattice in chunks, each of which drops its points outside the domain.
    constexpr size_t kGrain = 1024;
    std::vector<Positions<N>> chunks((count + kGrain - 1) / kGrain);
    parallelFor(
        count, kGrain,
        [&](size_t begin, size_t end) {
            for (size_t from = begin; from < end; from += kBatch) {
                const PointBatchN<N> points = batchOf(lattice, from, std::min(end, from + kBatch));
                std::array<bool, kBatch> allowed;
                std::array<double, kBatch> distance;
                classify(domain, points, allowed, distance);
                for (int i = 0; i < points.size; ++i)
                    if (allowed[static_cast<size_t>(i)]) chunks[begin / kGrain].push_back(points[i]);
            }
        },
        monitor);
    Positions<N> all;
    for (auto& chunk : chunks) {
        monitor.check();
        all.insert(all.end(), chunk.begin(), chunk.end());
        chunk = {};
    }
    return all;
}

template <int N>
FlowN<N> jitterFlow(const DomainN<N>& domain, double spacing, const JitterFlowOptions& options) {
    requirePositive(spacing, "spacing");
    requirePositive(options.frequency, "frequency");
    if (options.time && !std::isfinite(*options.time)) throw ValueError("time must be finite");
    auto potentials = [&]<size_t... K>(std::index_sequence<K...>) {
        return typename FlowN<N>::Potentials{noiseOf<N>(K, spacing, options)...};
    }
    (std::make_index_sequence<FlowN<N>::kPotentials>());
    if (domain.wall) potentials.back() = bounded(potentials.back(), *domain.wall);
    const FlowN<N> flow(std::move(potentials), domain);
    return options.uniform ? flow.normalized(1) : withSpeed(flow, 1);
}

template <int N>
AdvectResultN<N> jitter(const FlowN<N>& flow, Positions<N>& points, double spacing, double amount,
                        const Monitor& monitor) {
    requirePositive(spacing, "spacing");
    return advect(flow, points, {.time = amount * kStep * meanNeighbourDistance(N) * spacing, .steps = 1}, monitor);
}

template <int N>
void jitterRandomly(Positions<N>& points, double spacing, double amount, uint64_t seed) {
    requirePositive(spacing, "spacing");
    if (!std::isfinite(amount)) throw ValueError("amount must be finite");
    for (size_t k = 0; k < points.size(); ++k)
        for (int axis = 0; axis < N; ++axis)
            points[k][axis] += amount * spacing * (randomUniform(seed, k, static_cast<uint64_t>(axis)) - 0.5);
}

DomainN<2> inPlane(const Domain& domain) {
    const auto flat = [](const Vec3d& v) { return Vec<double, 2>{{v[0], v[1]}}; };
    const auto flatBox = [&](const Box& box) { return BoxN<2>{flat(box.lower), flat(box.upper)}; };
    DomainN<2> plane{.box = flatBox(domain.box), .wall = {}};
    if (!domain.wall) return plane;
    const Sdf& sdf = domain.wall->sdf;
    plane.wall = WallN<2>{.sdf = {.distance = lifted<2>(sdf.distance, {constantField<2>(0)}),
                                  .bounds = flatBox(sdf.bounds),
                                  .reach = 0, // the surface may be farther away within the plane than in space
                                  .lipschitz = sdf.lipschitz},
                          .side = domain.wall->side,
                          .width = domain.wall->width};
    return plane;
}

template <int N>
JitteredPositionsN<N> jitteredPositions(DomainN<N> domain, const JitteredLatticeOptions& o, const Monitor& monitor) {
    if (!domain.box.finite()) throw ValueError("the domain is infinite; give a box");
    const double spacing = o.spacing != 0 ? o.spacing : spacingFor(domain, o.count, monitor);
    auto points = latticePoints(domain, spacing, monitor);
    if (points.empty()) throw ValueError("no lattice point is in the domain; choose a smaller spacing");
    const bool conforms = domain.wall && o.conform && !o.random;
    if (domain.wall) domain.wall->width = o.width * spacing;
    if (!conforms) domain.wall.reset();
    if (o.random)
        jitterRandomly(points, spacing, o.amount, o.flow.seed);
    else
        jitter(jitterFlow(domain, spacing, o.flow), points, spacing, o.amount, monitor);
    return {std::move(points), spacing, conforms};
}

template <int N>
JitteredLattice jitteredLattice(const DomainN<N>& domain, const JitteredLatticeOptions& o, const Monitor& monitor) {
    const auto made = jitteredPositions(domain, o, monitor);
    std::vector<Vec3d> inSpace(made.positions.size());
    for (size_t k = 0; k < inSpace.size(); ++k)
        std::copy(made.positions[k].c.begin(), made.positions[k].c.end(), inSpace[k].c.begin());
    return {Points::at(inSpace), made.spacing, made.conforms};
}
template JitteredLattice jitteredLattice(const DomainN<2>&, const JitteredLatticeOptions&, const Monitor&);
template JitteredLattice jitteredLattice(const DomainN<3>&, const JitteredLatticeOptions&, const Monitor&);

#define CURLEW_INSTANTIATE(N)                                                                         \
    template Positions<N> latticePoints(const DomainN<N>&, double, const Monitor&);                   \
    template FlowN<N> jitterFlow(const DomainN<N>&, double, const JitterFlowOptions&);                \
    template AdvectResultN<N> jitter(const FlowN<N>&, Positions<N>&, double, double, const Monitor&); \
    template void jitterRandomly(Positions<N>&, double, double, uint64_t);                            \
    template JitteredPositionsN<N> jitteredPositions(DomainN<N>, const JitteredLatticeOptions&, const Monitor&);
CURLEW_FOR_FLOW_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
