// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/Advect.h"

#include "AdvectSteps.h"
#include "FirstStep.h"
#include "Freezing.h"
#include "SplitAdvector.h"
#include "curlew/field/Dimensions.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/track/WallMotion.h"
#include "curlew/track/WallVelocity.h"

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
    if (o.steps < 0) throw ValueError(fmt::format("{} steps; give at least 1, or 0 for as many as needed", o.steps));
    if (!std::isfinite(o.time)) throw ValueError("time must be finite");
    if (!(o.accuracy >= 0)) throw ValueError(fmt::format("accuracy {} must be positive", o.accuracy));
    if (o.adaptive() && !tableauOf(o.usedScheme()).embedded())
        throw ValueError(
            fmt::format("{} does not estimate its error; choose rk23 or rk45 for an accuracy, or give steps",
                        kSchemeNames[static_cast<size_t>(o.usedScheme())]));
    if (!(o.maxStep >= 0)) throw ValueError(fmt::format("a longest step of {} must be positive, or 0", o.maxStep));
    o.reprojection.validate(true); // a sum is split, or moved without reprojection
    splittingOf(flow, o);
}

/// For a flow that is not split. A sum has no tracks that a step could be put back onto, but its wall is guarded as
/// that of others, unless reprojection is off.
template <int N>
GuardedStepper<N> wholeStepper(const FlowN<N>& flow, const FlowMagnitudesN<N>& typical, const AdvectOptions& options) {
    ReprojectOptionsN<N> reprojection = inUnitsOf(typical, options.reprojection);
    if (flow.hasTracks()) return advectionStepper(flow, options, reprojection);
    const bool guarded = reprojection.method != Reprojection::none;
    reprojection.method = Reprojection::none;
    return {flow, StepBy::time, options.usedScheme(), reprojection, {.convergence = false, .walls = guarded}};
}

/// How many points with steps of their own one thread takes at a time: while some of them are still on their way others
/// can set out. It does not depend on the number of threads.
size_t poolSize(size_t points) { return kBatch * std::clamp<size_t>(points / 4096, 1, 16); }

template <int N>
using AdvectPart = typename BatchAdvector<N>::Part;

/// Moves points in batches: `load(part, begin)` before all steps, `store(part, begin)` after them.
template <int N, class Positions, class Load, class Store>
AdvectResultN<N> advectBatches(const FlowN<N>& flow, const AdvectScalesN<N>& scales, const Positions& points,
                               const AdvectOptions& given, const Load& load, const Store& store,
                               const Monitor& monitor) {
    const AdvectOptions options = withAccuracy(given, flow.domain());
    const FlowMagnitudesN<N>& typical = scales.flow;
    const Splitting splitting = splittingOf(flow, options);
    const bool split = splitting != Splitting::none;
    const auto termByTerm = [&] {
        // A flow that changes may have more terms by now.
        const bool known = scales.terms.size() == flow.terms().size();
        const SplitStepper<N> stepper(flow, known ? scales.terms : scalesOf(flow, options).terms, splitting, options);
        return sumOverBatches(
            points,
            [&](const PointBatchN<N>& start, size_t begin) {
                SplitAdvector<N> advector(stepper, start);
                load(advector.part(), begin);
                advector.run(monitor);
                const Tally<N> tally = advector.tally();
                store(advector.part(), begin);
                return tally;
            },
            monitor);
    };
    const auto asWhole = [&] {
        const AdvectOptions whole = withScheme(options, flow.domain());
        const GuardedStepper<N> stepper = wholeStepper(flow, typical, whole);
        const bool guesses = options.adaptive() && options.time != 0 && points.size() > 0;
        const double first = guesses ? firstStep(flow, whole.usedScheme(), options.accuracy) : 0;
        return parallelSum(
            points.size(), options.adaptive() ? poolSize(points.size()) : kBatch,
            [&](size_t begin, size_t end) {
                std::vector<PointBatchN<N>> batches;
                for (size_t k = begin; k < end; k += kBatch)
                    batches.push_back(batchOf(points, k, std::min(k + kBatch, end)));
                BatchAdvector<N> advector(stepper, whole, first, batches, flow.hasTracks() ? typical.speed : 0);
                for (size_t b = 0; b < batches.size(); ++b) load(advector.parts()[b], begin + b * kBatch);
                advector.run(monitor);
                const Tally<N> tally = advector.tally();
                for (size_t b = 0; b < batches.size(); ++b) store(advector.parts()[b], begin + b * kBatch);
                return tally;
            },
            monitor);
    };
    const Tally<N> sum = split ? termByTerm() : asWhole();
    const size_t count = points.size(), tried = sum.substeps + sum.retries + sum.stalled;
    const auto converged = static_cast<double>(std::max<size_t>(count - sum.notConverged, 1));
    AdvectResultN<N> result{
        .points = count,
        .notConverged = sum.notConverged,
        .stalled = sum.stalled,
        .outside = sum.outside,
        .substeps = sum.substeps,
        .retries = sum.retries,
        .coarse = sum.coarse,
        .meanIterations = static_cast<double>(sum.iterations) / static_cast<double>(std::max<size_t>(tried, 1)),
        .errorMean = sum.error / static_cast<double>(std::max<size_t>(count, 1)),
        .errorMax = sum.mostError,
        .splitting = splitting};
    if (split) result.drift = sum.drift;
    for (size_t q = 0; q < typical.potentials.size(); ++q)
        if (flow.hasTracks() && typical.potentials[q] > 0) {
            result.residual[q] = std::sqrt(sum.squares[q] / converged) / typical.potentials[q];
            result.drift[q] = sum.drift[q] / typical.potentials[q];
        }
    return result;
}

} // namespace

template <int N>
double defaultAccuracy(const DomainN<N>& domain) {
    const double diagonal = length(domain.box.size());
    if (!(diagonal > 0) || !std::isfinite(diagonal))
        throw ValueError("an accuracy is needed: the box of the flow's domain is infinite or a point");
    return kDefaultAccuracy * diagonal;
}

template <int N>
Splitting splittingOf(const FlowN<N>& flow, const AdvectOptions& options) {
    if (flow.hasTracks() || options.splitting == Splitting::none) return Splitting::none;
    if (!flow.divergenceFree())
        throw ValueError("a normalised sum is no sum of its terms and cannot be split; choose splitting=none");
    return options.splitting;
}

template <int N>
AdvectScalesN<N> detail::scalesOf(const FlowN<N>& flow, const AdvectOptions& options, const Monitor& monitor) {
    AdvectScalesN<N> scales{.flow = magnitudesOf(flow, monitor), .terms = {}};
    if (splittingOf(flow, options) == Splitting::none) return scales;
    for (const auto& term : flow.terms()) scales.terms.push_back(magnitudesOf(FlowN<N>(term, flow.domain()), monitor));
    return scales;
}

template <int N>
AdvectResultN<N>& AdvectResultN<N>::operator+=(const AdvectResultN& later) {
    const auto tried = [](const AdvectResultN& r) { return static_cast<double>(r.substeps + r.retries + r.stalled); };
    const double iterations = meanIterations * tried(*this) + later.meanIterations * tried(later);
    points = later.points;
    notConverged = later.notConverged;
    outside = later.outside;
    residual = later.residual;
    splitting = later.splitting;
    for (size_t q = 0; q < drift.size(); ++q) drift[q] = std::max(drift[q], later.drift[q]);
    stalled += later.stalled;
    substeps += later.substeps;
    retries += later.retries;
    coarse += later.coarse;
    overrun += later.overrun;
    errorMean += later.errorMean;
    errorMax += later.errorMax;
    moments += later.moments;
    freezing += later.freezing;
    meanIterations = iterations / std::max(tried(*this), 1.0);
    return *this;
}

template <int N>
AdvectResultN<N> advect(const FlowN<N>& flow, Positions<N>& points, const AdvectOptions& options,
                        const Monitor& monitor) {
    validate(flow, options);
    return advectBatches(
        flow, scalesOf(flow, options), points, options, [](AdvectPart<N>&, size_t) {},
        [&](const AdvectPart<N>& part, size_t begin) { storeBatch(part.tips.position, points, begin); }, monitor);
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
AdvectResult advectInOrder(const Flow& flow, const AdvectScales& scales, Points& particles,
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
        flow, scales, PointsBy{count, [&](size_t n) { return p.position(particle(n)); }}, options,
        [&](AdvectPart<3>& part, size_t begin) {
            for (size_t i = 0; i < part.size(); ++i) {
                const size_t k = particle(begin + i);
                part.converged[i] = p.converged[k] != 0;
                if (options.byAge && p.hasAge()) part.pace[i] = paceOf(p.age[k], wholeTime);
                if (onTrack) part.tips.track[0][i] = p.f[k], part.tips.track[1][i] = p.g[k];
            }
        },
        [&](const AdvectPart<3>& part, size_t begin) {
            for (size_t i = 0; i < part.size(); ++i) {
                const size_t k = particle(begin + i);
                p.setPosition(k, part.tips.position[static_cast<int>(i)]);
                p.setVelocity(k, part.tips.velocity[static_cast<int>(i)]);
                p.converged[k] = part.converged[i] ? 1 : 0;
                if (flow.hasTracks()) p.f[k] = part.tips.track[0][i], p.g[k] = part.tips.track[1][i];
            }
        },
        monitor);
}

/// Gives particles the flow's velocity and track where they are.
AdvectResult sample(const Flow& flow, const AdvectScales& scales, Points& particles, const std::vector<uint32_t>& order,
                    AdvectOptions options, const Monitor& monitor) {
    options.time = 0;
    options.accuracy = 0;
    options.steps = 1;
    particles.f.clear();
    particles.g.clear();
    return advectInOrder(flow, scales, particles, order, options, 0, monitor);
}

/// Over which the motion of the wall is looked at where a way of this time ends: the last of `steps` of it.
double lastWay(double time, int steps) {
    constexpr double kShort = 0.01; // seconds, where there is no way
    return time != 0 ? -time / steps : kShort;
}

/// A flow that changes, as it stands at a time.
struct FlowAt {
    double time;
    Flow flow;
};

/// Of the layer: as far as a wall may be off the mean of what it was and what it will be.
constexpr double kBent = 0.2;

/// Takes the particles along with the wall from one time to another. A wall that changes its form goes from one
/// distance to the other by their mean (WallMotion). If it is something else halfway, such as a thin limb that moves
/// farther than it is thick, each half is followed apart. Returns how many points it ran over.
size_t followWall(const FlowInTime& flow, const FlowAt& from, const FlowAt& to, Points& particles, int halvings,
                  const Monitor& monitor) {
    const auto &before = from.flow.domain().wall, &after = to.flow.domain().wall;
    if (!before && !after) return 0;
    const auto requireWall = [](bool there) {
        if (!there) throw ValueError("the flow has a wall at some times and none at others");
    };
    requireWall(before && after);
    const Box& box = from.flow.domain().box;
    const WallMotion motion(*before, *after, box);
    constexpr double kFar = 0.25; // of the layer
    if (halvings == 0 || motion.way() <= kFar * before->width) return motion.carry(particles, monitor);
    const double time = (from.time + to.time) / 2;
    const FlowAt middle{time, flow.at(time)};
    const auto& halfway = middle.flow.domain().wall;
    requireWall(halfway.has_value());
    if (offMean(*before, *halfway, *after, box) <= kBent * before->width) return motion.carry(particles, monitor);
    const size_t overrun = followWall(flow, from, middle, particles, halvings - 1, monitor);
    return overrun + followWall(flow, middle, to, particles, halvings - 1, monitor);
}

/// How often the halves of a step may be halved to follow the wall. Where its middle is off the mean by so much that a
/// fourth of it, as of a parabola, is still too much.
int halvingsFor(const FlowAt& before, const FlowAt& middle, const FlowAt& after) {
    const auto &from = before.flow.domain().wall, &halfway = middle.flow.domain().wall, &to = after.flow.domain().wall;
    const bool straight =
        from && halfway && to && offMean(*from, *halfway, *to, before.flow.domain().box) <= 4 * kBent * from->width;
    return straight ? 0 : 4;
}

} // namespace

AdvectResult advect(const Flow& flow, Points& particles, const AdvectOptions& options, const Monitor& monitor) {
    return detail::advectKnowing(flow, scalesOf(flow, options), particles, options, monitor);
}

AdvectResult detail::advectKnowing(const Flow& flow, const AdvectScales& scales, Points& particles,
                                   const AdvectOptions& options, const Monitor& monitor) {
    validate(flow, options);
    return advectInOrder(flow, scales, particles, orderFor(flow, particles), options, options.time, monitor);
}

AdvectResult advect(const FlowInTime& flow, Points& particles, double begin, const AdvectOptions& options,
                    const Monitor& monitor) {
    if (!std::isfinite(begin)) throw ValueError("the time to begin at must be finite");
    FlowAt before{begin, flow.at(begin)};
    if (flow.steady()) return advect(before.flow, particles, options, monitor);
    validate(before.flow, options);
    const AdvectOptions accurate = withAccuracy(options, before.flow.domain());
    const Monitor unreported{.report = {}, .cancelled = monitor.cancelled};
    const std::vector<uint32_t> order = orderFor(before.flow, particles);
    const AdvectScales scales = scalesOf(before.flow, options);
    // Unless an accuracy is asked for, no more often than said: a wall that changes is costly to make.
    const auto [count, freezingError] = options.accuracy > 0
                                            ? freezingOf(flow, before.flow, begin, accurate, scales, monitor)
                                            : Freezing{.moments = options.steps > 0 ? options.steps : kMoments};
    const AdvectOptions one = oneOf(count, accurate);
    AdvectResult total;
    const auto flowAt = [&](double part) {
        const double time = begin + options.time * (part / count);
        return FlowAt{time, flow.at(time)};
    };
    for (int k = 0; k < count; ++k) {
        const FlowAt middle = flowAt(k + 0.5), after = flowAt(k + 1);
        const int halvings = halvingsFor(before, middle, after);
        total.overrun += followWall(flow, before, middle, particles, halvings, unreported);
        particles.f.clear(); // tracks of the step before
        particles.g.clear();
        total += advectInOrder(middle.flow, scales, particles, order, one, options.time, unreported);
        total.overrun += followWall(flow, middle, after, particles, halvings, unreported);
        before = after;
        if (monitor.report) monitor.report((k + 1.0) / count);
    }
    const AdvectResult end = sample(before.flow, scales, particles, order, options, unreported);
    if (const auto wall = wallVelocity(flow, begin + options.time, lastWay(options.time, count)))
        addWallVelocity(*wall, particles);
    total.moments = static_cast<size_t>(count);
    total.freezing = freezingError;
    total.points = end.points;
    total.outside = end.outside;
    total.notConverged = end.notConverged;
    return total;
}

#define CURLEW_INSTANTIATE(N)                                                                          \
    template struct AdvectResultN<N>;                                                                  \
    template double defaultAccuracy(const DomainN<N>&);                                                \
    template Splitting splittingOf(const FlowN<N>&, const AdvectOptions&);                             \
    template AdvectScalesN<N> detail::scalesOf(const FlowN<N>&, const AdvectOptions&, const Monitor&); \
    template AdvectResultN<N> advect(const FlowN<N>&, Positions<N>&, const AdvectOptions&, const Monitor&);
CURLEW_FOR_FLOW_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
