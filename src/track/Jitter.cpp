#include "curlew/track/Jitter.h"

#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"
#include "curlew/base/Random.h"
#include "curlew/base/Require.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Dimensions.h"
#include "curlew/field/NoiseField.h"

#include <algorithm>
#include <utility>

namespace curlew {

namespace {

template <int N>
using Points = std::vector<Vec<double, N>>;

constexpr double kStep = 0.16; // of the mean distance to the neighbours

/// A noise of the flow, independent of the others.
template <int N>
ScalarFieldN<N> noiseOf(size_t potential, double spacing, const JitterFlowOptions& o) {
    const OctaveOptions octaves{.frequency = o.frequency / spacing};
    const SimplexOptions noise{.seed = randomBits(o.seed, potential)};
    if (!o.time) return noiseField<SimplexNoise<N>>(noise, octaves);
    if constexpr (N < 7)
        return lifted<N>(noiseField<SimplexNoise<N + 1>>(noise, octaves),
                         {constantField<N>(*o.time / octaves.frequency)});
    else
        throw ValueError("a flow in 7 dimensions has no time: the noise of 8 that it would be a slice of is not there");
}

} // namespace

double meanNeighbourDistance(int n) {
    if (n < 1) throw ValueError(fmt::format("{} dimensions; give at least 1", n));
    // Of the neighbours, 2^i (n over i) differ in i coordinates.
    double count = 1, sum = 0, all = 0;
    for (int i = 1; i <= n; ++i) {
        count *= 2.0 * (n - i + 1) / i;
        sum += count * std::sqrt(i);
        all += count;
    }
    return sum / all;
}

template <int N>
Points<N> latticePoints(const DomainN<N>& domain, double spacing, const Monitor& monitor) {
    requirePositive(spacing, "spacing");
    if (!domain.box.finite()) throw ValueError("the domain is infinite; give a box");
    std::array<size_t, N> cells;
    Vec<double, N> first;
    size_t count = 1;
    double bytes = sizeof(Vec<double, N>);
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
    // By chunks, so that each can leave out what is not in the domain.
    constexpr size_t kGrain = 1024;
    std::vector<Points<N>> chunks((count + kGrain - 1) / kGrain);
    parallelFor(
        count, kGrain,
        [&](size_t begin, size_t end) {
            for (size_t from = begin; from < end; from += kBatch) {
                PointBatchN<N> points;
                for (size_t k = from; k < std::min(end, from + kBatch); ++k) {
                    Vec<double, N> p = first;
                    size_t rest = k;
                    for (int axis = 0; axis < N; ++axis) {
                        const size_t n = cells[static_cast<size_t>(axis)];
                        p[axis] += spacing * static_cast<double>(rest % n);
                        rest /= n;
                    }
                    points.push(p);
                }
                std::array<bool, kBatch> allowed;
                std::array<double, kBatch> distance;
                classify(domain, points, allowed, distance);
                for (int i = 0; i < points.size; ++i)
                    if (allowed[static_cast<size_t>(i)]) chunks[begin / kGrain].push_back(points[i]);
            }
        },
        monitor);
    Points<N> all;
    for (const auto& chunk : chunks) all.insert(all.end(), chunk.begin(), chunk.end());
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
AdvectResultN<N> jitter(const FlowN<N>& flow, Points<N>& points, double spacing, double amount,
                        const Monitor& monitor) {
    requirePositive(spacing, "spacing");
    return advect(flow, points, {.time = amount * kStep * meanNeighbourDistance(N) * spacing, .steps = 1}, monitor);
}

template <int N>
void jitterRandomly(Points<N>& points, double spacing, double amount, uint64_t seed) {
    requirePositive(spacing, "spacing");
    if (!std::isfinite(amount)) throw ValueError("amount must be finite");
    for (size_t k = 0; k < points.size(); ++k)
        for (int axis = 0; axis < N; ++axis)
            points[k][axis] += amount * spacing * (randomUniform(seed, k, static_cast<uint64_t>(axis)) - 0.5);
}

#define CURLEW_INSTANTIATE(N)                                                                      \
    template Points<N> latticePoints(const DomainN<N>&, double, const Monitor&);                   \
    template FlowN<N> jitterFlow(const DomainN<N>&, double, const JitterFlowOptions&);             \
    template AdvectResultN<N> jitter(const FlowN<N>&, Points<N>&, double, double, const Monitor&); \
    template void jitterRandomly(Points<N>&, double, double, uint64_t);
CURLEW_FOR_FLOW_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
