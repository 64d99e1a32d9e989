// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/Advect.h"

#include "AdvectSteps.h"
#include "Freezing.h"
#include "SplitAdvector.h"
#include "curlew/base/Memory.h"
#include "curlew/field/Dimensions.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/track/AdvectParts.h"
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

/// Returns the stepper for a flow that is not split. The steps of a sum are not reprojected because it has no tracks,
/// but its wall is guarded like any other unless reprojection is off.
template <int N>
GuardedStepper<N> wholeStepper(const FlowN<N>& flow, const FlowRmsN<N>& rms, const AdvectOptions& options) {
    ReprojectOptionsN<N> reprojection = inUnitsOf(rms, options.reprojection);
    if (flow.hasTracks()) return advectionStepper(flow, options, reprojection);
    const bool guarded = reprojection.method != Reprojection::none;
    reprojection.method = Reprojection::none;
    return {flow, StepBy::time, options.usedScheme(), reprojection, {.convergence = false, .walls = guarded}};
}

/// Returns whether the rounding of float is far below the accuracy of the steps within them. The terms of a sum may
/// cancel, and the gradients of two potentials must not leave the range of float.
template <int N>
bool mayBeFloat(const FlowN<N>& flow, const FlowRmsN<N>& rms, const AdvectOptions& options) {
    constexpr double kSmall = 1e-12, kLarge = 1e12;
    return flow.hasTracks() && isCoarse(options, flow.domain()) &&
           std::all_of(rms.potentials.begin(), rms.potentials.end(),
                       [](double size) { return size > kSmall && size < kLarge; });
}

/// Returns how many points with adaptive steps one thread takes at a time: new points can start while others
/// still move, and only the last points leave lanes idle. At least 32 such pools keep many processors busy. Does not
/// depend on the number of threads.
size_t poolSize(size_t points) { return kBatch * std::clamp<size_t>(points / (32 * kBatch), 1, 32); }

template <int N>
using AdvectPart = typename BatchAdvector<N>::Part;

/// Moves points in batches. Calls `load(part, begin)` before all steps and `store(part, begin)` after them.
template <int N, class Positions, class Load, class Store>
AdvectResultN<N> advectBatches(const FlowN<N>& flow, const FlowRmsN<N>& rms, const Positions& points,
                               const AdvectOptions& given, const Load& load, const Store& store,
                               const Monitor& monitor) {
    const AdvectOptions options = withAccuracy(given, flow.domain());
    const Splitting splitting = splittingOf(flow, options);
    const bool split = splitting != Splitting::none;
    const auto termByTerm = [&] {
        // A time-dependent flow may have a different number of terms by now.
        const bool known = rms.terms.size() == flow.terms().size();
        const SplitStepper<N> stepper(flow, known ? rms.terms : rmsOf(flow, monitor.quiet()).terms, splitting, options);
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
        const GuardedStepper<N> stepper = wholeStepper(flow, rms, whole);
        const bool guesses = options.adaptive() && options.time != 0 && points.size() > 0;
        const double first = guesses ? firstStep(flow, whole.usedScheme(), options.accuracy) : 0;
        const double speed = flow.hasTracks() ? rms.speed : 0;
        const bool floatStages = mayBeFloat(flow, rms, whole);
        return parallelSum(
            points.size(), options.adaptive() ? poolSize(points.size()) : kBatch,
            [&](size_t begin, size_t end) {
                std::vector<PointBatchN<N>> batches;
                for (size_t k = begin; k < end; k += kBatch)
                    batches.push_back(batchOf(points, k, std::min(k + kBatch, end)));
                BatchAdvector<N> advector(stepper, whole, first, batches, speed, floatStages);
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
        .errorMax = sum.maxError,
        .splitting = splitting};
    if (split) result.drift = sum.drift;
    for (size_t q = 0; q < rms.potentials.size(); ++q)
        if (flow.hasTracks() && rms.potentials[q] > 0) {
            result.residual[q] = std::sqrt(sum.squares[q] / converged) / rms.potentials[q];
            result.drift[q] = sum.drift[q] / rms.potentials[q];
        }
    return result;
}

} // namespace

template <int N>
double defaultAccuracy(const DomainN<N>& domain) {
    const double diagonal = length(domain.box.size());
    if (!(diagonal > 0) || !std::isfinite(diagonal))
        throw ValueError(
            "give an accuracy: there is no default if the box of the flow's domain is infinite or a point");
    return kDefaultAccuracy * diagonal;
}

template <int N>
Splitting splittingOf(const FlowN<N>& flow, const AdvectOptions& options) {
    if (flow.hasTracks() || options.splitting == Splitting::none) return Splitting::none;
    if (flow.uniformSpeed() > 0)
        throw ValueError("a normalised sum is not the sum of its terms and cannot be split; choose splitting=none");
    if (!flow.components().empty())
        throw ValueError(
            "a flow without potentials (a velocity grid, a gradient) cannot be split; choose splitting=none, or make "
            "the potentials of the grid (-flow exact=1)");
    return options.splitting;
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
        flow, rmsOf(flow, monitor.quiet()), points, options, [](AdvectPart<N>&, size_t) {},
        [&](const AdvectPart<N>& part, size_t begin) { storeBatch(part.tips.position, points, begin); }, monitor);
}

namespace {

/// Moves particles that are neighbours in `order` together; `order` holds all particles or is empty. `wholeTime`: the
/// time of all steps, if these are only some of them.
AdvectResult advectInOrder(const Flow& flow, const FlowRms& rms, Points& particles, const std::vector<uint32_t>& order,
                           const AdvectOptions& options, double wholeTime, const Monitor& monitor) {
    const size_t count = particles.size();
    const bool onTrack = particles.hasTrack() && flow.hasTracks();
    if (!particles.hasVelocity())
        requireMemory(static_cast<double>(count) * (Points::kBytes - Points::kPlainBytes),
                      fmt::format("the velocities and tracks of {} points", count), "use fewer points");
    for (auto* array : {&particles.vx, &particles.vy, &particles.vz}) array->resize(count);
    for (auto* array : {&particles.f, &particles.g}) array->resize(flow.hasTracks() ? count : 0);
    particles.converged.resize(count, 1);
    Points& p = particles;
    const auto particle = [&](size_t k) { return order.empty() ? k : order[k]; };
    return advectBatches(
        flow, rms, PointsBy{count, [&](size_t n) { return p.position(particle(n)); }}, options,
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

/// Gives particles the flow's velocity and track at their positions.
AdvectResult sample(const Flow& flow, const FlowRms& rms, Points& particles, const std::vector<uint32_t>& order,
                    AdvectOptions options, const Monitor& monitor) {
    options.time = 0;
    options.accuracy = 0;
    options.steps = 1;
    particles.f.clear();
    particles.g.clear();
    return advectInOrder(flow, rms, particles, order, options, 0, monitor);
}

/// Returns the interval over which the wall's motion is sampled at the end of a motion of this time: the last of its
/// `steps`, backward.
double lastInterval(double time, int steps) {
    constexpr double kShort = 0.01; // seconds, if the time is 0
    return time != 0 ? -time / steps : kShort;
}

/// A time-dependent flow frozen at a time.
struct FlowAt {
    double time;
    Flow flow;
};

/// Tolerated deviation of a wall from the mean of the walls before and after it, relative to the layer.
constexpr double kBent = 0.2;

/// How often a step may be halved to follow a wall that is not close to that mean.
constexpr int kMostHalvings = 4;

/// Moves the particles with the wall from one time to another. A wall that changes its form is interpolated linearly
/// between its two distances (WallMotion). If the wall halfway differs from that, as with a thin limb that moves
/// farther than its thickness, each half is followed separately. Returns the number of points that the wall ran over.
size_t followWall(const FlowInTime& flow, const FlowAt& from, const FlowAt& to, Points& particles, int subdivisions,
                  const Monitor& monitor) {
    const auto &before = from.flow.domain().wall, &after = to.flow.domain().wall;
    if (!before && !after) return 0;
    const auto requireWall = [](bool there) {
        if (!there) throw ValueError("the flow has a wall at some times but not at others");
    };
    requireWall(before && after);
    const Box& box = from.flow.domain().box;
    const WallMotion motion(*before, *after, box, to.time - from.time);
    constexpr double kFar = 0.25; // relative to the layer
    if (subdivisions == 0 || motion.maxChange() <= kFar * before->width) return motion.carry(particles, monitor);
    const double time = (from.time + to.time) / 2;
    const FlowAt middle{time, flow.at(time)};
    const auto& halfway = middle.flow.domain().wall;
    requireWall(halfway.has_value());
    if (offMean(*before, *halfway, *after, box) <= kBent * before->width) return motion.carry(particles, monitor);
    const size_t overrun = followWall(flow, from, middle, particles, subdivisions - 1, monitor);
    return overrun + followWall(flow, middle, to, particles, subdivisions - 1, monitor);
}

/// Returns how often the halves of a step may be halved to follow the wall. If the wall moved along a parabola, each
/// half would deviate from its mean by a quarter of the whole step's deviation; returns 0 if that quarter is tolerable.
int subdivisionsFor(const FlowAt& before, const FlowAt& middle, const FlowAt& after) {
    const auto &from = before.flow.domain().wall, &halfway = middle.flow.domain().wall, &to = after.flow.domain().wall;
    const bool straight =
        from && halfway && to && offMean(*from, *halfway, *to, before.flow.domain().box) <= 4 * kBent * from->width;
    return straight ? 0 : kMostHalvings;
}

} // namespace

AdvectResult advect(const Flow& flow, Points& particles, const AdvectOptions& options, const Monitor& monitor) {
    return detail::advectKnowing(flow, rmsOf(flow, monitor.quiet()), particles, options, monitor);
}

AdvectResult detail::advectKnowing(const Flow& flow, const FlowRms& rms, Points& particles,
                                   const AdvectOptions& options, const Monitor& monitor) {
    validate(flow, options);
    return advectInOrder(flow, rms, particles, advectionOrder(flow, particles), options, options.time, monitor);
}

AdvectResult advect(const FlowInTime& flow, Points& particles, double begin, const AdvectOptions& options,
                    const Monitor& monitor) {
    const size_t overrun = detail::takeNewbornBack(flow, particles, begin, options, monitor.quiet());
    AdvectResult result = detail::advectPart(flow, particles, begin, options, options.time, monitor);
    result.overrun += overrun;
    return result;
}

size_t detail::takeNewbornBack(const FlowInTime& flow, Points& particles, double begin, const AdvectOptions& options,
                               const Monitor& monitor) {
    if (!options.byAge || !particles.hasAge() || flow.steady()) return 0;
    std::vector<size_t> indices;
    std::vector<Vec3d> positions;
    for (size_t k = 0; k < particles.size(); ++k)
        if (paceOf(particles.age[k], options.time) < 1) {
            indices.push_back(k);
            positions.push_back(particles.position(k));
        }
    if (indices.empty()) return 0;
    Points newborn = Points::at(positions);
    const auto flowAt = [&](double time) { return FlowAt{time, flow.at(time)}; };
    const size_t overrun =
        followWall(flow, flowAt(begin + options.time), flowAt(begin), newborn, kMostHalvings, monitor);
    for (size_t n = 0; n < indices.size(); ++n) particles.setPosition(indices[n], newborn.position(n));
    return overrun;
}

AdvectResult detail::advectPart(const FlowInTime& flow, Points& particles, double begin, const AdvectOptions& options,
                                double wholeTime, const Monitor& monitor) {
    if (!std::isfinite(begin)) throw ValueError("the start time must be finite");
    FlowAt before{begin, flow.at(begin)};
    validate(before.flow, options);
    if (flow.steady())
        return advectInOrder(before.flow, rmsOf(before.flow, monitor.quiet()), particles,
                             advectionOrder(before.flow, particles), options, wholeTime, monitor);
    const AdvectOptions accurate = withAccuracy(options, before.flow.domain());
    const Monitor unreported = monitor.quiet();
    const std::vector<uint32_t> order = advectionOrder(before.flow, particles);
    const FlowRms rms = rmsOf(before.flow, unreported);
    // Without an accuracy, use the given number: creating a wall that changes is expensive.
    const Freezing freezing = options.accuracy > 0 ? freezingOf(flow, before.flow, begin, accurate, rms, monitor)
                                                   : Freezing{.moments = options.steps > 0 ? options.steps : kMoments};
    const int count = freezing.moments;
    const AdvectOptions one = oneOf(count, accurate);
    AdvectResult total;
    const auto flowAt = [&](double part) {
        const double time = begin + options.time * (part / count);
        return FlowAt{time, flow.at(time)};
    };
    for (int k = 0; k < count; ++k) {
        const FlowAt middle = flowAt(k + 0.5), after = flowAt(k + 1);
        const int subdivisions = subdivisionsFor(before, middle, after);
        total.overrun += followWall(flow, before, middle, particles, subdivisions, unreported);
        particles.f.clear(); // tracks of the previous step
        particles.g.clear();
        total += advectInOrder(middle.flow, rms, particles, order, one, wholeTime, unreported);
        total.overrun += followWall(flow, middle, after, particles, subdivisions, unreported);
        before = after;
        if (monitor.report) monitor.report((k + 1.0) / count);
    }
    const AdvectResult end = sample(before.flow, rms, particles, order, options, unreported);
    if (const auto wall = wallVelocity(flow, begin + options.time, lastInterval(options.time, count)))
        addWallVelocity(*wall, particles);
    total.moments = static_cast<size_t>(count);
    total.freezing = freezing.error;
    total.points = end.points;
    total.outside = end.outside;
    total.notConverged = end.notConverged;
    return total;
}

#define CURLEW_INSTANTIATE(N)                                              \
    template struct AdvectResultN<N>;                                      \
    template double defaultAccuracy(const DomainN<N>&);                    \
    template Splitting splittingOf(const FlowN<N>&, const AdvectOptions&); \
    template AdvectResultN<N> advect(const FlowN<N>&, Positions<N>&, const AdvectOptions&, const Monitor&);
CURLEW_FOR_FLOW_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
