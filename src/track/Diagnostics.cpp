#include "curlew/track/Diagnostics.h"

#include "curlew/base/Random.h"
#include "curlew/field/Dimensions.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/track/Scatter.h"

#include <algorithm>
#include <limits>
#include <mutex>

namespace curlew {

namespace {

constexpr uint64_t kSeed = 0x636865636b;

/// The greatest of `value(k)` over [0, count).
template <class Value>
double greatest(size_t count, const Value& value, const Monitor& monitor) {
    double most = 0;
    std::mutex merging;
    parallelFor(
        count, 256,
        [&](size_t begin, size_t end) {
            double own = 0;
            for (size_t k = begin; k < end; ++k) own = std::max(own, value(k));
            const std::lock_guard lock(merging);
            most = std::max(most, own);
        },
        monitor);
    return most;
}

/// The divergence at a point by the trace of the derivative, and by central differences, relative to the derivative's
/// norm.
struct Divergence {
    double trace = 0, byDifferences = 0;
};

template <int N>
Divergence divergenceAt(const FlowN<N>& flow, const Vec<double, N>& p, double h) {
    const FlowSampleN<N> sample = flow.at(p);
    double trace = 0, squares = 0;
    for (int i = 0; i < N; ++i) {
        trace += sample.derivative[i][i];
        squares += dot(sample.derivative[i], sample.derivative[i]);
    }
    if (!(squares > 0)) return {};
    PointBatchN<N> around;
    for (int i = 0; i < 2 * N; ++i) {
        Vec<double, N> q = p;
        q[i / 2] += i % 2 ? h : -h;
        around.push(q);
    }
    VecBatchN<double, N> c;
    flow.velocity(around, c);
    double difference = 0;
    for (int axis = 0; axis < N; ++axis) difference += (c[2 * axis + 1][axis] - c[2 * axis][axis]) / (2 * h);
    return {std::abs(trace) / std::sqrt(squares), difference / std::sqrt(squares)};
}

/// Points of the domain. In space it takes as many tries as are needed.
template <int N>
std::vector<Vec<double, N>> pointsOf(const DomainN<N>& domain, size_t count, const Monitor& monitor) {
    std::vector<Vec<double, N>> points(count);
    if constexpr (N == 3) {
        const Points scattered = scatter(domain, count, kSeed, monitor);
        for (size_t k = 0; k < count; ++k) points[k] = scattered.position(k);
        return points;
    }
    const Vec<double, N> size = domain.box.size();
    for (size_t k = 0; k < count; ++k)
        for (int axis = 0; axis < N; ++axis)
            points[k][axis] =
                domain.box.lower[axis] + size[axis] * randomUniform(kSeed, k, static_cast<uint64_t>(axis));
    if (domain.wall)
        std::erase_if(points, [&](const Vec<double, N>& p) {
            return beyondWall(domain.wall->side, domain.wall->sdf.distance.template at<0>(p).value) >= 0;
        });
    return points;
}

/// Moves a point onto the zero level of d; false where that does not work.
bool ontoWall(const ScalarField& distance, const Box& box, Vec3d& p) {
    constexpr int kMostIterations = 30;
    for (int k = 0; k < kMostIterations; ++k) {
        const auto d = distance.at<1>(p);
        if (std::abs(d.value) < 1e-13 * (1 + length(p))) return box.contains(p);
        const double squared = dot(d.gradient, d.gradient);
        if (!(squared > 1e-6)) return false;
        p -= d.gradient * (d.value / squared);
    }
    return false;
}

void diagnoseWall(const Flow& flow, size_t samples, FlowDiagnostics& check, const Monitor& monitor) {
    const Wall& wall = *flow.domain().wall;
    // Start near the wall: anywhere within its width, on both sides.
    Domain layer{.box = flow.domain().box, .wall = wall};
    layer.wall->side = Side::both;
    const Points seeds = scatter(layer, samples, kSeed + 1, monitor);
    std::vector<uint8_t> onWall(samples);
    check.wallFlux = greatest(
                         samples,
                         [&](size_t k) {
                             Vec3d p = seeds.position(k);
                             const double start = wall.sdf.distance.at<0>(p).value;
                             if (std::abs(start) > std::max(wall.width, 0.5 * wall.sdf.reach) ||
                                 !ontoWall(wall.sdf.distance, flow.domain().box, p))
                                 return 0.0;
                             onWall[k] = 1;
                             const auto d = wall.sdf.distance.at<1>(p);
                             return std::abs(dot(flow.at(p).velocity, d.gradient));
                         },
                         monitor) /
                     check.magnitudes.speed;
    check.wallSamples = static_cast<size_t>(std::count(onWall.begin(), onWall.end(), 1));
}

/// The sum of the squares of what central differences over ±h are off the gradients of these jets.
template <int N>
double differencesOff(const ScalarFieldN<N>& field, const PointBatchN<N>& points, const JetBatchN<double, N, 1>& jets,
                      double h) {
    double sum = 0;
    for (int axis = 0; axis < N; ++axis) {
        PointBatchN<N> above = points, below = points;
        for (int i = 0; i < points.size; ++i) {
            above.c[static_cast<size_t>(axis)][static_cast<size_t>(i)] += h;
            below.c[static_cast<size_t>(axis)][static_cast<size_t>(i)] -= h;
        }
        JetBatchN<double, N, 0> up, down;
        field.eval(above, up);
        field.eval(below, down);
        for (int i = 0; i < points.size; ++i) {
            const double off = (up[i].value - down[i].value) / (2 * h) - jets[i].gradient[axis];
            sum += off * off;
        }
    }
    return sum;
}

} // namespace

template <int N>
FieldDiagnostics diagnoseField(const ScalarFieldN<N>& field, const BoxN<N>& box, size_t samples,
                               const Monitor& monitor) {
    if (!box.finite()) throw ValueError("a field is measured in a finite box");
    const auto points = pointsOf(DomainN<N>{.box = box, .wall = {}}, samples, monitor);
    const Vec<double, N> size = box.size();
    const double h = *std::max_element(size.c.begin(), size.c.end()) / 4096;
    struct Sums {
        Range range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
        double values = 0, gradients = 0, whole = 0, half = 0;
        Sums& operator+=(const Sums& o) {
            range = {std::min(range.lower, o.range.lower), std::max(range.upper, o.range.upper)};
            values += o.values;
            gradients += o.gradients;
            whole += o.whole;
            half += o.half;
            return *this;
        }
    };
    const Sums total = sumOverBatches(
        points,
        [&](const PointBatchN<N>& batch, size_t) {
            JetBatchN<double, N, 1> jets;
            field.eval(batch, jets);
            Sums sums;
            for (int i = 0; i < batch.size; ++i) {
                const auto jet = jets[i];
                sums += {{jet.value, jet.value}, jet.value * jet.value, dot(jet.gradient, jet.gradient)};
            }
            sums.whole = differencesOff(field, batch, jets, h);
            sums.half = differencesOff(field, batch, jets, 0.5 * h);
            return sums;
        },
        monitor);
    const auto n = static_cast<double>(std::max<size_t>(points.size(), 1));
    const double gradients = total.gradients > 0 ? total.gradients : 1;
    return {total.range, std::sqrt(total.values / n), std::sqrt(total.gradients / n),
            std::sqrt(total.whole / gradients), std::sqrt(total.half / gradients)};
}

template <int N>
DivergenceDiagnostics diagnoseDivergence(const FlowN<N>& flow, size_t samples, const Monitor& monitor) {
    const auto& domain = flow.domain();
    const auto points = pointsOf(domain, samples, monitor);
    const Vec<double, N> size = domain.box.size();
    const double h = 1e-5 * *std::max_element(size.c.begin(), size.c.end());
    std::vector<Divergence> divergence(points.size());
    std::vector<uint8_t> beyond(points.size(), 1);
    parallelFor(
        points.size(), 256,
        [&](size_t begin, size_t end) {
            for (size_t k = begin; k < end; ++k) {
                divergence[k] = divergenceAt(flow, points[k], h);
                if (const auto& wall = domain.wall)
                    beyond[k] =
                        beyondWall(wall->side, wall->sdf.distance.template at<0>(points[k]).value) < -wall->width;
            }
        },
        monitor);
    DivergenceDiagnostics check;
    double squares = 0;
    for (size_t k = 0; k < points.size(); ++k) {
        check.trace = std::max(check.trace, divergence[k].trace);
        if (beyond[k]) check.traceBeyond = std::max(check.traceBeyond, divergence[k].trace);
        squares += divergence[k].byDifferences * divergence[k].byDifferences;
    }
    check.byDifferences = std::sqrt(squares / static_cast<double>(std::max<size_t>(points.size(), 1)));
    return check;
}

#define CURLEW_INSTANTIATE(N) \
    template FieldDiagnostics diagnoseField(const ScalarFieldN<N>&, const BoxN<N>&, size_t, const Monitor&);
CURLEW_FOR_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE
#define CURLEW_INSTANTIATE(N) \
    template DivergenceDiagnostics diagnoseDivergence(const FlowN<N>&, size_t, const Monitor&);
CURLEW_FOR_FLOW_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

FlowDiagnostics diagnoseFlow(const Flow& flow, size_t samples, const Monitor& monitor) {
    FlowDiagnostics check{.divergence = diagnoseDivergence(flow, samples, monitor),
                          .magnitudes = magnitudesOf(flow, monitor)};
    if (flow.domain().wall) diagnoseWall(flow, samples, check, monitor);
    return check;
}

ParticleDiagnostics diagnoseParticles(const Flow& flow, const Points& particles, const Monitor& monitor) {
    struct Tally {
        std::array<double, Flow::kPotentials> squares{}; // of the drift
        double penetration = -std::numeric_limits<double>::infinity();
        size_t converged = 0, outside = 0;
        Tally& operator+=(const Tally& o) {
            for (size_t q = 0; q < squares.size(); ++q) squares[q] += o.squares[q];
            penetration = std::max(penetration, o.penetration);
            converged += o.converged;
            outside += o.outside;
            return *this;
        }
    };
    const size_t count = particles.size();
    const Tally total = sumOverBatches(
        particles,
        [&](const PointBatch& points, size_t begin) {
            Tally tally;
            std::array<bool, kBatch> allowed;
            std::array<double, kBatch> distance;
            classify(flow.domain(), points, allowed, distance);
            std::array<JetBatch<double, 0>, Flow::kPotentials> potentials;
            for (size_t q = 0; q < potentials.size(); ++q) flow.potentials()[q].eval(points, potentials[q]);
            const std::array tracks{&particles.f, &particles.g};
            for (size_t i = 0; i < static_cast<size_t>(points.size); ++i) {
                if (flow.domain().wall) {
                    tally.outside += !allowed[i];
                    tally.penetration = std::max(tally.penetration, beyondWall(flow.domain().wall->side, distance[i]));
                }
                const size_t k = begin + i;
                if (!particles.converged.empty() && !particles.converged[k]) continue;
                ++tally.converged;
                if (!particles.hasTrack()) continue;
                for (size_t q = 0; q < potentials.size(); ++q) {
                    const double drift = potentials[q].c[0][i] - (*tracks[q])[k];
                    tally.squares[q] += drift * drift;
                }
            }
            return tally;
        },
        monitor);
    const FlowMagnitudes typical = magnitudesOf(flow, monitor);
    const auto n = static_cast<double>(std::max<size_t>(total.converged, 1));
    const auto drift = [&](size_t q) {
        const double scale = typical.potentials[q];
        return scale > 0 ? std::sqrt(total.squares[q] / n) / scale : 0;
    };
    return {.points = count,
            .outside = total.outside,
            .notConverged = count - total.converged,
            .penetration = flow.domain().wall && count > 0 ? total.penetration : 0,
            .driftF = drift(0),
            .driftG = drift(1)};
}

} // namespace curlew
