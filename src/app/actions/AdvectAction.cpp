// SPDX-License-Identifier: Apache-2.0
#include "AdvectAction.h"

#include "GpuOption.h"
#include "LoopAction.h"
#include "MovingWall.h"
#include "PointsN.h"
#include "TrackOptions.h"
#include "curlew/app/registry/InContext.h"
#include "curlew/app/registry/Options.h"
#include "curlew/app/registry/Text.h"
#include "curlew/app/run/Context.h"
#include "curlew/track/FlowAtWall.h"
#include "curlew/track/Pathlines.h"
#include "curlew/track/VolumeChange.h"

#include <algorithm>
#include <utility>

namespace curlew::app {

namespace {

using namespace options;

const Binding<AdvectOptions>& advectBinding() {
    static const auto binding =
        Binding<AdvectOptions>()
            .add(
                formerly(
                    {"time"},
                    real("duration", "", "s",
                         "advection time; negative runs backward. After -frames, without duration=: the time between "
                         "frames")),
                [](auto& o) -> auto& { return o.time; })
            .include(
                stepBinding<AdvectOptions>(
                    "number of equal steps, instead of steps chosen by accuracy=. With both, accuracy= chooses the "
                    "steps, and this is the number of intervals in which a time-dependent flow is held constant and a "
                    "pathline gets a vertex (default: after -frames, its substeps; else 100 for pathlines and schemes "
                    "without error estimate)",
                    "maximum estimated error of each step of a point (default: 1e-6 of the diagonal of the flow's box, "
                    "unless steps=, dt= or a scheme without error estimate is given); from 3e-5 of the diagonal on, "
                    "scheme=auto is rk23"),
                [](auto& o) -> auto& { return o; })
            .addOptional(
                formerly({"longest"}, positive("maxStep", "", "world units",
                                               "maximum displacement of a point in one step (default: unlimited)")),
                [](auto& o) -> auto& { return o.maxStep; })
            .add(
                choice("splitting", kSplittingNames,
                       "integration of a flow that is a sum: as a whole (none), most accurate; or term by term, each "
                       "on its own tracks (strang: second order, yoshida: fourth), which preserves volumes even with "
                       "long steps; reproject= alone selects strang"),
                [](auto& o) -> auto& { return o.splitting; })
            .include(
                reprojectionBinding({},
                                    "method that projects points back onto their track and keeps them from crossing "
                                    "walls; with none, they drift and may cross",
                                    "point stays where it is; 0: accept the corrected position, as in ICN Algorithm 1"),
                [](auto& o) -> auto& { return o.reprojection; });
    return binding;
}

template <int N>
AdvectOptions advectOptions(const Context& c, const Arguments& a, const DomainN<N>& domain) {
    constexpr int kEqualSteps = 100; // for a scheme without error estimate
    AdvectOptions options = advectBinding().read(a);
    if (c.clock() && !a.given("duration")) {
        options.time = c.clock()->duration;
        options.byAge = true;
    }
    if (a.given("dt")) {
        options.steps =
            inContextOf("dt=" + a.written().at("dt"), [&] { return std::max(1, stepsOf(options.time, a.real("dt"))); });
    } else if (asksForEqualSteps(a, options.scheme)) {
        options.steps = c.clock() ? c.clock()->substeps : kEqualSteps;
    } else if (c.clock() && !a.given("steps")) {
        options.steps = c.clock()->substeps;
        if (!a.given("accuracy")) options.accuracy = defaultAccuracy(domain);
    }
    return options;
}

/// Warns about the terms of a sum that are not tangent to its wall, though the sum is. (-superpose warns of a sum that
/// is not.)
void warnOfTerms(const Context& c, const SumAtWall& sum) {
    std::vector<std::string> crossing;
    double flux = 0;
    for (size_t k = 0; k < sum.terms.size(); ++k)
        if (!sum.terms[k].tangent()) {
            crossing.push_back(fmt::format("{}", k + 1));
            flux = std::max(flux, sum.terms[k].flux);
        }
    if (!crossing.empty() && sum.whole.tangent())
        c.warn(
            fmt::format("{} {} of {} cross{} the wall, at up to {:.2g} of {} rms speed, though the sum does not; "
                        "splitting follows each term by itself, so points stop there: use splitting=none",
                        crossing.size() == 1 ? "term" : "terms", join(crossing, " and "), sum.terms.size(),
                        crossing.size() == 1 ? "es" : "", flux, crossing.size() == 1 ? "its" : "their"));
}

/// Sets the options for a flow that is a sum. Warns if points may cross its wall, or if a term is not tangent to it.
void prepareSum(Context& c, const Arguments& a, const Flow& flow, AdvectOptions& options) {
    if (flow.hasTracks()) return;
    const bool reprojects = options.reprojection.method != Reprojection::none;
    if (reprojects && a.given("reproject") && !a.given("splitting")) options.splitting = Splitting::strang;
    if (!flow.domain().wall || c.memory().figures.contains("terms")) return; // warned in the first frame
    if (!reprojects) return c.warn("with reproject=none, points drift and may cross the wall");
    if (options.splitting != Splitting::none)
        warnOfTerms(c, sumAtWall(flow, 2000, c.follow("checking the terms at the wall")));
}

/// Describes how the tracks were kept.
std::string tracksOf(const AdvectResult& result, bool sum) {
    if (!sum) return fmt::format("residuals f {:.1e} g {:.1e}", result.residual[0], result.residual[1]);
    if (result.splitting == Splitting::none) return "integrated as a whole";
    return fmt::format("sum integrated by splitting ({}), labels drift by {:.1e} at most",
                       kSplittingNames.at(static_cast<size_t>(result.splitting)),
                       std::max(result.drift[0], result.drift[1]));
}

/// `estimated`: whether the scheme estimates its error.
void reportAdvect(Context& c, const Flow& flow, const AdvectResult& result, const Points& particles, bool estimated) {
    const bool sum = !flow.hasTracks();
    const double stepsEach =
        static_cast<double>(result.substeps) / static_cast<double>(std::max<size_t>(result.points, 1));
    const std::string freezing =
        result.freezing > 0 ? fmt::format("; flow held constant in {} intervals, which costs about {:.1e} on average",
                                          result.moments, result.freezing)
                            : "";
    const std::string error =
        estimated ? fmt::format("; estimated error, summed over the steps: {:.1e} on average, {:.1e} at most",
                                result.errorMean, result.errorMax)
                  : "";
    c.info(fmt::format(
        "advect: {} points, {:.4g} steps each{}{}; {:.3g} corrections per step, {}, {} steps repeated, {} "
        "points not converged, {} on the wrong side of the wall{}",
        result.points, stepsEach, error, freezing, result.meanIterations, tracksOf(result, sum), result.retries,
        result.notConverged, result.outside, flow.domain().wall && c.madeFromLevelSet("flow") ? " (a level set)" : ""));
    if (result.coarse > 0)
        c.warn(fmt::format(
            "{} of {} steps exceed the requested error; use a larger accuracy=, more steps= or more maxSubdivisions=",
            result.coarse, result.substeps));
    if (result.points > 0 && result.outside == result.points)
        c.warn(
            fmt::format("all {} points are on the wrong side of the flow's wall, and do not move; put them where the "
                        "flow is (-scatter after -dfvn does), or bound the flow on the other side (-bound side=)",
                        result.points));
    if (result.overrun > 0) c.warn(fmt::format("a moving wall passed over {} points; use more steps", result.overrun));
    Json& report = c.memory().figures;
    // The sums are those of all frames so far.
    const auto total = [&](const char* name, auto now) { return report.value(name, decltype(now){0}) + now; };
    const double errorMean = total("error_mean", result.errorMean), errorMax = total("error_max", result.errorMax);
    const double freezingError = total("freezing_error", result.freezing);
    const size_t moments = total("moments", result.moments);
    const size_t outsideMost = std::max(report.value("outside_most", size_t{0}), result.outside);
    report = {{"points", result.points},
              {"substeps", total("substeps", result.substeps)},
              {"retries", total("retries", result.retries)},
              {"stalled", total("stalled", result.stalled)},
              {"coarse", total("coarse", result.coarse)},
              {"overrun", total("overrun", result.overrun)},
              {"not_converged", result.notConverged},
              {"iterations_mean", result.meanIterations},
              {"residual_f", result.residual[0]},
              {"residual_g", result.residual[1]},
              {"speed_max", particles.maxSpeed()},
              {"outside", result.outside},
              {"outside_most", outsideMost}};
    if (result.moments > 0) {
        report["moments"] = moments;
        report["freezing_error"] = freezingError;
    }
    if (sum) {
        report["terms"] = flow.terms().size();
        report["splitting"] = kSplittingNames.at(static_cast<size_t>(result.splitting));
        report["label_drift"] = std::max(result.drift[0], result.drift[1]);
    }
    if (estimated) {
        report["error_mean"] = errorMean;
        report["error_max"] = errorMax;
    }
    c.report("advect") = report;
}

/// Reports how the flow changes volumes along the paths of some of the points, before they are advected.
void reportVolumes(Context& c, const Arguments& a, const FlowInTime& flow, double begin, const AdvectOptions& options,
                   const Points& particles) {
    const auto count = std::min(a.integer<size_t>("jacobian"), particles.size());
    std::vector<Vec3d> sample;
    for (size_t k = 0; k < count; ++k) {
        const size_t n = k * particles.size() / count;
        sample.push_back({{particles.x[n], particles.y[n], particles.z[n]}});
    }
    const VolumeChange change = volumeChange(flow, sample, begin, options, c.follow("volumes"));
    c.info(
        fmt::format("advect: volumes change by a factor of {:.9g} (median), from {:.9g} to {:.9g} for 90 % of {} "
                    "samples, and differ from 1 by at most {:.1e}",
                    change.median, change.lower, change.upper, change.samples, change.farthest));
    c.report("volume") = {{"samples", change.samples},
                          {"median", change.median},
                          {"lower", change.lower},
                          {"upper", change.upper},
                          {"farthest", change.farthest}};
}

/// Moves points of N > 3 dimensions along a flow of as many.
template <int N>
void advectPointsN(Context& c, const Arguments& a) {
    const auto* flow = std::get_if<FlowN<N>>(&c.anyFlow("flow"));
    if (!flow)
        throw ValueError(
            fmt::format("the points have {} dimensions, but the flow has {}", N, dimensionOf(c.anyFlow("flow"))));
    for (const char* option : {"loop", "jacobian", "pathlines"})
        if (a.given(option)) throw ValueError(fmt::format("{}= needs points in 3D, not in {} dimensions", option, N));
    if (asksForGpu(a)) throw ValueError(fmt::format("device=gpu needs points in 3D, not in {} dimensions", N));
    if (c.clock())
        throw ValueError(
            fmt::format("points of {} dimensions cannot move from frame to frame; use -advect duration= "
                        "before -frames",
                        N));
    const AdvectOptions options = advectOptions(c, a, flow->domain());
    auto positions = std::get<std::vector<Vec<double, N>>>(*c.anyPoints("points").positionsN);
    const AdvectResultN<N> result = advect(*flow, positions, options, c.follow("advect"));
    const double residual = *std::max_element(result.residual.begin(), result.residual.end());
    c.info(
        fmt::format("advect: {} points in {} dimensions, {:.4g} steps each; residuals {:.1e} at most, {} points not "
                    "converged",
                    result.points, N,
                    static_cast<double>(result.substeps) / static_cast<double>(std::max<size_t>(result.points, 1)),
                    residual, result.notConverged));
    c.report("advect") = {{"points", result.points},     {"substeps", result.substeps},
                          {"retries", result.retries},   {"not_converged", result.notConverged},
                          {"residual_max", residual},    {"error_mean", result.errorMean},
                          {"error_max", result.errorMax}};
    givePointsN(c, std::move(positions));
}

void runAdvect(Context& c, const Arguments& a) {
    if (const auto& positions = c.anyPoints("points").positionsN)
        return withDimension(dimensionOf(*positions), [&](auto n) { advectPointsN<n>(c, a); });
    if (a.given("loop")) return loopAction(c, a, advectBinding().read(a).reprojection);
    const FlowInTime flow = c.flowInTime("flow");
    const double begin = c.clock() ? c.clock()->begin : c.moment().time;
    const Flow first = flow.at(begin);
    AdvectOptions options = advectOptions(c, a, first.domain());
    const bool estimated = tableauOf(options.usedScheme()).embedded();
    prepareSum(c, a, first, options);
    warnOfMovingWall(c, flow, begin, options.time, "points may end up on the wrong side");
    PointSet set = c.takePoints("points");
    Points& particles = set.particles;
    const TrackedFlow tracked = c.tracked("flow");
    if (tracked.identity != set.tracked.identity || tracked.frame != set.tracked.frame)
        for (auto* track : {&particles.f, &particles.g}) track->clear(); // these belong to another flow
    set.tracked = tracked;
    if (a.integer("jacobian") > 0) reportVolumes(c, a, flow, begin, options, particles);
    const Monitor monitor = c.follow("advect");
    const auto onGpu = advectedOnGpu(c, a, flow, begin, particles, options,
                                     a.flag("pathlines") ? "pathlines are made on the processor only" : "", monitor);
    if (!a.flag("pathlines")) {
        const AdvectResult result = onGpu ? *onGpu : advect(flow, particles, begin, options, monitor);
        reportAdvect(c, first, result, particles, estimated);
        return c.give(std::make_shared<PointSet>(std::move(set)));
    }
    Pathlines pathlines = advectWithPathlines(flow, particles, begin, options, monitor);
    reportAdvect(c, first, pathlines.result, particles, estimated);
    c.give(std::make_shared<PointSet>(std::move(set)));
    c.give(std::make_shared<const Curves>(std::move(pathlines.curves)));
}

std::vector<Option> advectDeclared() {
    std::vector<Option> all = advectBinding().options();
    all.insert(all.begin() + 2,
               instead(positive("dt", "", "s", "maximum length of a step, instead of steps="), {"steps"}));
    all.push_back(timeless(
        instead(positive(
                    "loop", "", "s",
                    "loop: period after which each point is back at its start; duration= is the time in the loop "
                    "(default: T). Needs a steady flow inside a wall. Points whose track does not close, or takes more "
                    "than 4/3 of the period, fade (attribute fade, 0 to 1)"),
                {"steps", "dt", "scheme", "maxStep", "jacobian", "pathlines", "device"}),
        {{"duration", "{T}"}}));
    all.push_back(integer(
        "jacobian", "0", 0, 1e6,
        "number of points at which the volume change of the flow map is measured: the determinant of its Jacobian"));
    all.push_back(
        formerly({"trails"},
                 flag("pathlines", "0", "1: also make pathlines (trails) of the points, with a vertex at each step")));
    all.push_back(deviceOption());
    all.push_back(keep());
    return all;
}

} // namespace

Action advectAction() {
    return {.name = "advect",
            .group = "points",
            .summary = "advect particles: move the newest points along the newest flow, each on its own track",
            .takes = {stays("flow", {Kind::flow}), changed("points", {Kind::points})},
            .makes = {made("points", {Kind::points}), made("curves", {Kind::curves}, "pathlines")},
            .options = advectDeclared(),
            .examples =
                {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn speed=1 -scatter "
                 "-advect duration=2 -write points.ply",
                 "curlew -noise type=simplex dimensions=4 -noise type=simplex dimensions=4 seed=1 -noise type=simplex "
                 "dimensions=4 seed=2 -dfvn speed=1 -scatter count=1000 -advect duration=0.5 -write points4.csv"},
            .inFrames = InFrames::each,
            .run = runAdvect};
}

} // namespace curlew::app
