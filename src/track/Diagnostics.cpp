// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/Diagnostics.h"

#include "OntoWall.h"
#include "curlew/base/Random.h"
#include "curlew/field/Differences.h"
#include "curlew/field/Dimensions.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/track/Scatter.h"

#include <algorithm>
#include <limits>
#include <mutex>

namespace curlew {

namespace {

constexpr uint64_t kSeed = 0x636865636b;

/// Returns infinity for NaN, so that it does not pass for a small error.
double orInfinity(double value) { return std::isnan(value) ? std::numeric_limits<double>::infinity() : value; }

/// Returns the maximum of `value(k)` over [0, count); infinity if one of them is NaN.
template <class Value>
double greatest(size_t count, const Value& value, const Monitor& monitor) {
    double most = 0;
    std::mutex merging;
    parallelFor(
        count, 256,
        [&](size_t begin, size_t end) {
            double own = 0;
            for (size_t k = begin; k < end; ++k) own = std::max(own, orInfinity(value(k)));
            const std::lock_guard lock(merging);
            most = std::max(most, own);
        },
        monitor);
    return most;
}

/// Returns the normal of the level set of a flow's last potential if the flow preserves its area, otherwise zero. (So
/// the divergence within the level set is the trace of a derivative D minus n · D n.)
template <int N>
Vec<double, N> normalOf(const FlowN<N>& flow, const Vec<double, N>& p) {
    if (!flow.preservesArea()) return {};
    const auto gradient = flow.potentials().back().template at<1>(p).gradient;
    const double size = length(gradient);
    return size > 0 ? gradient * (1 / size) : gradient;
}

/// Scalars of the velocity's Jacobian at a point.
struct Derivative {
    double trace = 0; ///< |divergence| / norm; infinite if the velocity or its Jacobian is not finite.
    double norm2 = 0; ///< Frobenius norm, squared.
    double speed2 = 0;
};

template <int N>
Derivative derivativeAt(const FlowN<N>& flow, const Vec<double, N>& p) {
    const FlowSampleN<N> sample = flow.at(p);
    const Vec<double, N> normal = normalOf(flow, p);
    double trace = -dot(normal, sample.derivative * normal), squares = 0;
    for (int i = 0; i < N; ++i) {
        trace += sample.derivative[i][i];
        squares += dot(sample.derivative[i], sample.derivative[i]);
    }
    const double speed2 = dot(sample.velocity, sample.velocity);
    if (!std::isfinite(squares + speed2)) return {.trace = std::numeric_limits<double>::infinity()};
    if (!(squares > 0)) return {.speed2 = speed2};
    return {std::abs(trace) / std::sqrt(squares), squares, speed2};
}

/// Returns the sum of squares of the divergence by central differences over ±h; infinity if one of them is NaN.
template <int N>
double divergenceByDifferences(const FlowN<N>& flow, const PointBatchN<N>& points, double h) {
    std::array<double, kBatch> divergence{};
    std::array<Vec<double, N>, kBatch> normal;
    for (int i = 0; i < points.size; ++i) normal[static_cast<size_t>(i)] = normalOf(flow, points[i]);
    for (size_t axis = 0; axis < N; ++axis) {
        PointBatchN<N> above = points, below = points;
        for (size_t i = 0; i < static_cast<size_t>(points.size); ++i) {
            above.c[axis][i] += h;
            below.c[axis][i] -= h;
        }
        VecBatchN<double, N> up, down;
        flow.velocity(above, up);
        flow.velocity(below, down);
        for (size_t i = 0; i < static_cast<size_t>(points.size); ++i)
            divergence[i] += (up.c[axis][i] - down.c[axis][i]) / (2 * h);
        for (size_t i = 0; i < static_cast<size_t>(points.size) && flow.preservesArea(); ++i) {
            const int k = static_cast<int>(i);
            divergence[i] -= dot(normal[i], up[k] - down[k]) * normal[i][static_cast<int>(axis)] / (2 * h);
        }
    }
    double sum = 0;
    for (size_t i = 0; i < static_cast<size_t>(points.size); ++i) sum += divergence[i] * divergence[i];
    return orInfinity(sum);
}

/// Returns points of the domain: exactly `count` in 3D; in other dimensions those of `count` that the wall allows.
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

void diagnoseWall(const Flow& flow, size_t samples, FlowDiagnostics& check, const Monitor& monitor) {
    const Wall& wall = *flow.domain().wall;
    // Start near the wall: anywhere within its width, on both sides.
    Domain layer{.box = flow.domain().box, .wall = wall};
    layer.wall->side = Side::both;
    const Points seeds = scatter(layer, samples, kSeed + 1, monitor);
    std::vector<uint8_t> onWall(samples);
    const double flux = greatest(
        samples,
        [&](size_t k) {
            const auto p = detail::ontoWall(wall, flow.domain().box, seeds.position(k));
            if (!p) return 0.0;
            onWall[k] = 1;
            const auto d = wall.sdf.distance.at<1>(*p);
            return std::abs(dot(flow.at(*p).velocity, d.gradient));
        },
        monitor);
    check.wallFlux = flux > 0 ? orInfinity(flux / check.rms.speed) : 0;
    check.wallSamples = static_cast<size_t>(std::count(onWall.begin(), onWall.end(), 1));
}

/// Returns the sum of squared differences between central differences over ±h and the gradients of these jets.
template <int N>
double differencesOff(const ScalarFieldN<N>& field, const PointBatchN<N>& points, const JetBatchN<double, N, 1>& jets,
                      double h) {
    double sum = 0;
    forCentralDifferences(field, points, h, [&](int i, int axis, double difference) {
        const double off = difference - jets[i].gradient[axis];
        sum += off * off;
    });
    return sum;
}

} // namespace

template <int N>
FieldDiagnostics diagnoseField(const ScalarFieldN<N>& field, const BoxN<N>& box, size_t samples,
                               const Monitor& monitor) {
    if (!box.finite()) throw ValueError("a field can only be measured in a finite box");
    const auto points = pointsOf(DomainN<N>{.box = box, .wall = {}}, samples, monitor);
    const Vec<double, N> size = box.size();
    const double h = *std::max_element(size.c.begin(), size.c.end()) / 4096;
    struct Sums {
        Interval range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
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

std::optional<double> DivergenceDiagnostics::order() const {
    constexpr double kRounding = 1e-10;
    if (!(byHalfDifferences > kRounding)) return std::nullopt;
    return std::log2(byDifferences / byHalfDifferences);
}

bool DivergenceDiagnostics::vanishes() const {
    constexpr double kMinOrder = 0.25;
    return std::isfinite(trace) && order().value_or(1) > kMinOrder;
}

template <int N>
DivergenceDiagnostics diagnoseDivergence(const FlowN<N>& flow, size_t samples, const Monitor& monitor) {
    const auto& domain = flow.domain();
    const auto points = pointsOf(domain, samples, monitor);
    std::vector<Derivative> derivatives(points.size());
    std::vector<uint8_t> beyond(points.size(), 1);
    parallelFor(
        points.size(), 256,
        [&](size_t begin, size_t end) {
            for (size_t k = begin; k < end; ++k) {
                derivatives[k] = derivativeAt(flow, points[k]);
                if (const auto& wall = domain.wall)
                    beyond[k] =
                        beyondWall(wall->side, wall->sdf.distance.template at<0>(points[k]).value) < -wall->width;
            }
        },
        monitor);
    DivergenceDiagnostics check;
    double norm2 = 0, speed2 = 0;
    for (size_t k = 0; k < points.size(); ++k) {
        check.trace = std::max(check.trace, derivatives[k].trace);
        if (beyond[k]) check.traceBeyond = std::max(check.traceBeyond, derivatives[k].trace);
        norm2 += derivatives[k].norm2;
        speed2 += derivatives[k].speed2;
    }
    if (!(norm2 > 0) || !(speed2 > 0)) return check;
    constexpr double kStep = 1.0 / 128;
    check.step = kStep * std::sqrt(speed2 / norm2);
    const auto over = [&](double h) {
        const double sum = sumOverBatches(
            points, [&](const PointBatchN<N>& batch, size_t) { return divergenceByDifferences(flow, batch, h); },
            monitor);
        return std::sqrt(sum / norm2);
    };
    check.byDifferences = over(check.step);
    check.byHalfDifferences = over(0.5 * check.step);
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
    FlowDiagnostics check{.divergence = diagnoseDivergence(flow, samples, monitor), .rms = rmsOf(flow, monitor)};
    if (flow.domain().wall) diagnoseWall(flow, samples, check, monitor);
    return check;
}

ParticleDiagnostics diagnoseParticles(const Flow& flow, const Points& particles, const Monitor& monitor) {
    struct Tally {
        std::array<double, Flow::kPotentials> squares{}; // sums of squared drifts
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
    const bool onTracks = particles.hasTrack() && flow.hasTracks();
    const Tally total = sumOverBatches(
        particles,
        [&](const PointBatch& points, size_t begin) {
            Tally tally;
            std::array<bool, kBatch> allowed;
            std::array<double, kBatch> distance;
            classify(flow.domain(), points, allowed, distance);
            std::array<JetBatch<double, 0>, Flow::kPotentials> potentials;
            for (size_t q = 0; q < potentials.size() && onTracks; ++q) flow.potentials()[q].eval(points, potentials[q]);
            const std::array tracks{&particles.f, &particles.g};
            for (size_t i = 0; i < static_cast<size_t>(points.size); ++i) {
                if (flow.domain().wall) {
                    tally.outside += !allowed[i];
                    tally.penetration = std::max(tally.penetration, beyondWall(flow.domain().wall->side, distance[i]));
                }
                const size_t k = begin + i;
                if (!particles.converged.empty() && !particles.converged[k]) continue;
                ++tally.converged;
                if (!onTracks) continue;
                for (size_t q = 0; q < potentials.size(); ++q) {
                    const double drift = potentials[q].c[0][i] - (*tracks[q])[k];
                    tally.squares[q] += drift * drift;
                }
            }
            return tally;
        },
        monitor);
    const FlowRms rms = rmsOf(flow, monitor);
    const auto n = static_cast<double>(std::max<size_t>(total.converged, 1));
    const auto drift = [&](size_t q) {
        const double scale = rms.potentials[q];
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
