#include "curlew/track/Advect.h"

#include "AdvectSteps.h"
#include "BatchAdvector.h"
#include "curlew/field/Dimensions.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/track/WallMotion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <utility>

namespace curlew {

using namespace detail;

namespace {

template <int N>
using Positions = std::vector<Vec<double, N>>;

template <int N>
void validate(const FlowN<N>& flow, const AdvectOptions& o) {
    if (o.steps < 1) throw ValueError(fmt::format("{} steps; give at least 1", o.steps));
    if (!std::isfinite(o.time)) throw ValueError("time must be finite");
    if (!(o.accuracy > 0)) throw ValueError(fmt::format("accuracy {} must be positive", o.accuracy));
    if (!(o.maxStep >= 0)) throw ValueError(fmt::format("a longest step of {} must be positive, or 0", o.maxStep));
    o.reprojection.validate(flow.hasTracks());
}

/// Moves points in batches: `load(advector, begin)` before all steps, `store(advector, begin)` after them.
template <int N, class Positions, class Load, class Store>
AdvectResultN<N> advectBatches(const FlowN<N>& flow, const FlowMagnitudesN<N>& typical, const Positions& points,
                               const AdvectOptions& options, const Load& load, const Store& store,
                               const Monitor& monitor) {
    const auto stepper = advectionStepper(flow, options, inUnitsOf(typical, options.reprojection));
    const Tally<N> sum = sumOverBatches(
        points,
        [&](const PointBatchN<N>& start, size_t begin) {
            BatchAdvector<N> batch(stepper, options, start);
            load(batch, begin);
            batch.run(monitor);
            const Tally<N> tally = batch.tally();
            store(batch, begin);
            return tally;
        },
        monitor);
    const size_t count = points.size();
    const auto converged = static_cast<double>(std::max<size_t>(count - sum.notConverged, 1));
    AdvectResultN<N> result{
        .points = count,
        .notConverged = sum.notConverged,
        .stalled = sum.stalled,
        .outside = sum.outside,
        .substeps = sum.substeps,
        .retries = sum.retries,
        .coarse = sum.coarse,
        .meanIterations = static_cast<double>(sum.iterations) / static_cast<double>(std::max<size_t>(sum.substeps, 1))};
    for (size_t q = 0; q < typical.potentials.size(); ++q)
        if (flow.hasTracks() && typical.potentials[q] > 0)
            result.residual[q] = std::sqrt(sum.squares[q] / converged) / typical.potentials[q];
    return result;
}

} // namespace

template <int N>
AdvectResultN<N>& AdvectResultN<N>::operator+=(const AdvectResultN& later) {
    const double iterations =
        meanIterations * static_cast<double>(substeps) + later.meanIterations * static_cast<double>(later.substeps);
    points = later.points;
    notConverged = later.notConverged;
    outside = later.outside;
    residual = later.residual;
    stalled += later.stalled;
    substeps += later.substeps;
    retries += later.retries;
    coarse += later.coarse;
    overrun += later.overrun;
    meanIterations = iterations / static_cast<double>(std::max<size_t>(substeps, 1));
    return *this;
}

template <int N>
AdvectResultN<N> advect(const FlowN<N>& flow, Positions<N>& points, const AdvectOptions& options,
                        const Monitor& monitor) {
    validate(flow, options);
    return advectBatches(
        flow, magnitudesOf(flow), points, options, [](BatchAdvector<N>&, size_t) {},
        [&](BatchAdvector<N>& batch, size_t begin) { storeBatch(batch.position(), points, begin); }, monitor);
}

namespace {

/// The particles in the order of a Z-curve (Morton 1966) through the box: those of a batch are then near each other,
/// and look up the same parts of a level set.
std::vector<uint32_t> alongCurve(const Points& p, const Box& box) {
    constexpr int kBits = 10;
    const auto cell = [](double x, double lower, double size) {
        const double c = (x - lower) / size * (1 << kBits);
        return c > 0 ? static_cast<uint32_t>(std::min(c, (1 << kBits) - 1.0)) : 0u; // NaN, too
    };
    const Vec3d size = box.size();
    std::vector<std::pair<uint32_t, uint32_t>> codes(p.size());
    for (size_t k = 0; k < p.size(); ++k) {
        const std::array<uint32_t, 3> c{cell(p.x[k], box.lower[0], size[0]), cell(p.y[k], box.lower[1], size[1]),
                                        cell(p.z[k], box.lower[2], size[2])};
        uint32_t code = 0;
        for (int bit = kBits - 1; bit >= 0; --bit)
            for (const uint32_t axis : c) code = code << 1 | (axis >> bit & 1);
        codes[k] = {code, static_cast<uint32_t>(k)};
    }
    std::sort(codes.begin(), codes.end());
    std::vector<uint32_t> order(codes.size());
    for (size_t k = 0; k < codes.size(); ++k) order[k] = codes[k].second;
    return order;
}

/// No particle depends on another, so the order changes nothing but the time.
std::vector<uint32_t> orderFor(const Flow& flow, const Points& particles) {
    const bool pays = flow.domain().wall && flow.domain().box.finite() && particles.size() <= UINT32_MAX;
    return pays ? alongCurve(particles, flow.domain().box) : std::vector<uint32_t>{};
}

/// What part of the time a particle of this age moves.
double paceOf(float age, double time) {
    const double whole = std::abs(time), lived = static_cast<double>(age);
    return lived < whole ? std::max(lived, 0.0) / whole : 1; // all of it for NaN
}

/// Particles that are near each other in the order, which holds all or is empty, are moved together.
/// `wholeTime`: that of all steps, of which these may be some.
AdvectResult advectInOrder(const Flow& flow, const FlowMagnitudes& typical, Points& particles,
                           const std::vector<uint32_t>& order, const AdvectOptions& options, double wholeTime,
                           const Monitor& monitor) {
    const size_t count = particles.size();
    const bool onTrack = particles.hasTrack() && flow.hasTracks();
    for (auto* array : {&particles.vx, &particles.vy, &particles.vz}) array->resize(count);
    for (auto* array : {&particles.f, &particles.g}) array->resize(flow.hasTracks() ? count : 0);
    particles.converged.resize(count, 1);
    Points& p = particles;
    const auto particle = [&](size_t k) { return order.empty() ? k : order[k]; };
    return advectBatches(
        flow, typical, PointsBy{count, [&](size_t n) { return p.position(particle(n)); }}, options,
        [&](BatchAdvector<3>& batch, size_t begin) {
            for (size_t i = 0; i < static_cast<size_t>(batch.position().size); ++i) {
                const size_t k = particle(begin + i);
                batch.converged()[i] = p.converged[k] != 0;
                if (options.byAge && p.hasAge()) batch.pace()[i] = paceOf(p.age[k], wholeTime);
                if (onTrack) batch.track()[0][i] = p.f[k], batch.track()[1][i] = p.g[k];
            }
        },
        [&](BatchAdvector<3>& batch, size_t begin) {
            for (size_t i = 0; i < static_cast<size_t>(batch.position().size); ++i) {
                const size_t k = particle(begin + i);
                p.setPosition(k, batch.position()[static_cast<int>(i)]);
                p.setVelocity(k, batch.velocity()[static_cast<int>(i)]);
                p.converged[k] = batch.converged()[i] ? 1 : 0;
                if (flow.hasTracks()) p.f[k] = batch.track()[0][i], p.g[k] = batch.track()[1][i];
            }
        },
        monitor);
}

/// Gives particles the flow's velocity and track where they are.
AdvectResult sample(const Flow& flow, const FlowMagnitudes& typical, Points& particles,
                    const std::vector<uint32_t>& order, AdvectOptions options, const Monitor& monitor) {
    options.time = 0;
    options.steps = 1;
    particles.f.clear();
    particles.g.clear();
    return advectInOrder(flow, typical, particles, order, options, 0, monitor);
}

/// Adds that with which the particles have come from there in this time.
void addVelocity(Points& p, const std::array<std::vector<double>, 3>& from, double time) {
    for (size_t k = 0; k < p.size(); ++k) {
        p.vx[k] += static_cast<float>((p.x[k] - from[0][k]) / time);
        p.vy[k] += static_cast<float>((p.y[k] - from[1][k]) / time);
        p.vz[k] += static_cast<float>((p.z[k] - from[2][k]) / time);
    }
}

} // namespace

AdvectResult advect(const Flow& flow, Points& particles, const AdvectOptions& options, const Monitor& monitor) {
    return detail::advectKnowing(flow, magnitudesOf(flow), particles, options, monitor);
}

AdvectResult detail::advectKnowing(const Flow& flow, const FlowMagnitudes& typical, Points& particles,
                                   const AdvectOptions& options, const Monitor& monitor) {
    validate(flow, options);
    return advectInOrder(flow, typical, particles, orderFor(flow, particles), options, options.time, monitor);
}

AdvectResult advect(const FlowInTime& flow, Points& particles, double begin, const AdvectOptions& options,
                    const Monitor& monitor) {
    if (!std::isfinite(begin)) throw ValueError("the time to begin at must be finite");
    Flow before = flow.at(begin);
    if (flow.steady()) return advect(before, particles, options, monitor);
    validate(before, options);
    AdvectOptions one = options;
    one.steps = 1;
    one.time = options.time / options.steps;
    const Monitor unreported{.report = {}, .cancelled = monitor.cancelled};
    const std::vector<uint32_t> order = orderFor(before, particles);
    const FlowMagnitudes typical = magnitudesOf(before);
    const auto wallOf = [](const Flow& f) { return f.domain().wall; };
    AdvectResult total;
    double iterations = 0;
    std::array<std::vector<double>, 3> beforeLast; // where they are when the wall takes them along for the last time
    const auto followed = [&](const Flow& from, const Flow& to) {
        if (wallOf(from).has_value() != wallOf(to).has_value())
            throw ValueError("the flow has a wall at some times and none at others");
        if (!wallOf(from)) return;
        total.overrun += WallMotion(*wallOf(from), *wallOf(to), from.domain().box).carry(particles, unreported);
    };
    for (int k = 0; k < options.steps; ++k) {
        const Flow middle = flow.at(begin + one.time * (k + 0.5)), after = flow.at(begin + one.time * (k + 1));
        followed(before, middle);
        particles.f.clear(); // tracks of the step before
        particles.g.clear();
        const AdvectResult step = advectInOrder(middle, typical, particles, order, one, options.time, unreported);
        if (k == options.steps - 1) beforeLast = {particles.x, particles.y, particles.z};
        followed(middle, after);
        total += step;
        iterations += step.meanIterations * static_cast<double>(step.substeps);
        before = after;
        if (monitor.report) monitor.report((k + 1.0) / options.steps);
    }
    const AdvectResult end = sample(before, typical, particles, order, options, unreported);
    if (one.time != 0) addVelocity(particles, beforeLast, one.time / 2);
    total.points = end.points;
    total.outside = end.outside;
    total.notConverged = end.notConverged;
    total.meanIterations = iterations / static_cast<double>(std::max<size_t>(total.substeps, 1)); // divided once
    return total;
}

#define CURLEW_INSTANTIATE(N)         \
    template struct AdvectResultN<N>; \
    template AdvectResultN<N> advect(const FlowN<N>&, Positions<N>&, const AdvectOptions&, const Monitor&);
CURLEW_FOR_FLOW_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
