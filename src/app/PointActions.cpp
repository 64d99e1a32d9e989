#include "Options.h"
#include "ScatterDomain.h"
#include "curlew/app/Registry.h"
#include "curlew/app/Session.h"
#include "curlew/base/Memory.h"
#include "curlew/track/Distance.h"
#include "curlew/track/Neighbours.h"
#include "curlew/track/Pathlines.h"
#include "curlew/track/Scatter.h"
#include "curlew/track/Snap.h"
#include "curlew/track/VolumeChange.h"

#include <utility>

namespace curlew::app {

namespace {

using namespace options;

const std::string kGroup = "points";

void scatterAction(Session& s, const Arguments& a) {
    const auto count = static_cast<size_t>(a.integer("count"));
    const Domain domain = scatterDomain(s, a);
    requireMemory(static_cast<double>(count) * Particles::kBytes, fmt::format("{} points", count), "scatter fewer");
    s.geometry.push(scatter(domain, count, static_cast<uint64_t>(a.integer("seed")), s.console.follow("scatter")),
                    s.now());
}

/// How many steps of at most dt= there are in a time.
int stepsOf(double time, const Arguments& a) {
    if (a.given("steps")) throw ValueError("steps= and dt= say the same; give one of them");
    return std::max(1, curlew::stepsOf(time, a.real("dt")));
}

AdvectOptions advectOptions(const Session& s, const Arguments& a) {
    AdvectOptions options{.time = a.real("time"),
                          .steps = static_cast<int>(a.integer("steps")),
                          .scheme = static_cast<Scheme>(a.choice("scheme")),
                          .reprojection = {.method = static_cast<Reprojection>(a.choice("reproject")),
                                           .tolerance = a.real("tolerance"),
                                           .iterations = static_cast<int>(a.integer("iterations")),
                                           .maxSubdivisions = static_cast<int>(a.integer("halvings"))},
                          .accuracy = a.real("accuracy"),
                          .maxStep = a.given("longest") ? a.real("longest") : 0};
    if (s.clock && !a.given("time")) {
        options.time = s.clock->duration;
        options.byAge = true;
    }
    if (s.clock && !a.given("steps")) options.steps = s.clock->substeps;
    if (a.given("dt")) options.steps = stepsOf(options.time, a);
    return options;
}

void reportAdvect(Session& s, const AdvectResult& result, const Particles& particles) {
    s.console.say(
        fmt::format("advect: {} points, {:.3g} corrections a step, residuals f {:.1e} g {:.1e}, {} steps redone, {} "
                    "points not converged, {} outside",
                    result.points, result.meanIterations, result.residual[0], result.residual[1], result.retries,
                    result.notConverged, result.outside));
    if (result.coarse > 0)
        s.console.warn(fmt::format("{} of {} steps are coarser than asked for; give more steps or halvings",
                                   result.coarse, result.substeps));
    if (result.overrun > 0)
        s.console.warn(fmt::format("a moving wall ran over {} points; give more steps", result.overrun));
    auto& report = s.report["advect"];
    if (!report.is_object()) report = nlohmann::ordered_json::object();
    const auto total = [&](const char* name, size_t now) {
        return (s.clock ? report.value(name, size_t{0}) : 0) + now;
    };
    const size_t outsideMost = std::max(s.clock ? report.value("outside_most", size_t{0}) : 0, result.outside);
    report = {{"points", result.points},
              {"substeps", total("substeps", result.substeps)},
              {"retries", total("retries", result.retries)},
              {"kept_back", total("kept_back", result.stalled)},
              {"coarse", total("coarse", result.coarse)},
              {"overrun", total("overrun", result.overrun)},
              {"not_converged", result.notConverged},
              {"iterations_mean", result.meanIterations},
              {"residual_f", result.residual[0]},
              {"residual_g", result.residual[1]},
              {"speed_max", particles.maxSpeed()},
              {"outside", result.outside},
              {"outside_most", outsideMost}};
}

/// How the flow changes volumes on the way that some of the points are about to go.
void reportVolumes(Session& s, const Arguments& a, const FlowInTime& flow, double begin, const AdvectOptions& options,
                   const Particles& particles) {
    const auto count = std::min(static_cast<size_t>(a.integer("jacobian")), particles.size());
    std::vector<Vec3d> sample;
    for (size_t k = 0; k < count; ++k) {
        const size_t n = k * particles.size() / count;
        sample.push_back({{particles.x[n], particles.y[n], particles.z[n]}});
    }
    const VolumeChange change = volumeChange(flow, sample, begin, options, 0, s.console.follow("volumes"));
    s.console.say(
        fmt::format("advect: volumes change by a factor of {:.6g}, from {:.6g} to {:.6g} for 90 % of {} samples",
                    change.median, change.lower, change.upper, change.samples));
    s.report["volume"] = {
        {"samples", change.samples}, {"median", change.median}, {"lower", change.lower}, {"upper", change.upper}};
}

void advectAction(Session& s, const Arguments& a) {
    Particles& particles = s.particles();
    const FlowInTime flow = s.flowInTime();
    const double begin = s.clock ? s.clock->begin : 0;
    const Flow first = flow.at(begin);
    AdvectOptions options = advectOptions(s, a);
    if (!first.hasTracks() && !a.given("reproject")) {
        options.reprojection.method = Reprojection::none;
        s.console.warn("this flow is a sum and has no tracks: points drift, and may cross walls");
    }
    const uint64_t made = s.flows.entry().made;
    if (std::exchange(s.trackedFlow, made) != made)
        for (auto* track : {&particles.f, &particles.g}) track->clear(); // of another flow
    if (a.integer("jacobian") > 0) reportVolumes(s, a, flow, begin, options, particles);
    const Monitor monitor = s.console.follow("advect");
    if (!a.flag("trails")) return reportAdvect(s, advect(flow, particles, begin, options, monitor), particles);
    Pathlines pathlines = advectWithPathlines(flow, particles, begin, options, monitor);
    reportAdvect(s, pathlines.result, particles);
    s.geometry.push(std::make_shared<const Curves>(std::move(pathlines.curves)), s.now());
}

void snapAction(Session& s, const Arguments& a) {
    Particles& particles = s.particles();
    const double reach = a.real("reach");
    const ScalarField field = a.given("iso") ? inSpace(s.fields.at().field) : s.newestSdf(reach).distance;
    const double iso = a.given("iso") ? a.real("iso") : 0;
    const SnapResult result = snap(field, iso, particles, reach, 1e-9, s.console.follow("snap"));
    s.console.say(fmt::format("snap: {} points, moved by {:.4g} in the mean; {} are too far away", result.points,
                              result.moved, result.missed));
    s.report["snap"] = {{"points", result.points}, {"moved", result.moved}, {"missed", result.missed}};
}

void distanceAction(Session& s, const Arguments& a) {
    const auto ages = a.ages("geo");
    if (ages.size() != 2) throw ValueError("geo= wants two sets of points or of curves, as 0,1");
    const Geometry &first = s.geometry.at(ages[0]), &second = s.geometry.at(ages[1]);
    const Monitor monitor = s.console.follow("distance");
    const Distance d = std::visit(
        [&](const auto& p) -> Distance {
            using Kind = std::remove_cvref_t<decltype(p)>;
            const auto* q = std::get_if<Kind>(&second);
            if constexpr (std::is_same_v<Kind, Particles>) {
                if (q) return distanceBetween(p, *q, monitor);
            } else if constexpr (std::is_same_v<Kind, std::shared_ptr<const Curves>>) {
                if (q) return distanceBetween(*p, **q, monitor);
            }
            throw ValueError("both have to be points, or both curves");
        },
        first);
    s.console.say(fmt::format("distance: {:.6g} in the mean, {:.6g} at most, of {} pairs", d.mean, d.max, d.pairs));
    auto& report = s.report["distance"];
    const size_t earlier = s.clock && report.is_object() ? report.value("unmatched_all", size_t{0}) : 0;
    report = {{"pairs", d.pairs}, {"mean", d.mean},           {"rms", d.rms},
              {"max", d.max},     {"unmatched", d.unmatched}, {"unmatched_all", earlier + d.unmatched}};
}

void spacingAction(Session& s, const Arguments& a) {
    const Particles& particles = s.particles();
    requireMemory(static_cast<double>(particles.size()) * sizeof(Vec3d), fmt::format("{} points", particles.size()),
                  "give fewer");
    std::vector<Vec3d> points(particles.size());
    for (size_t k = 0; k < points.size(); ++k) points[k] = {{particles.x[k], particles.y[k], particles.z[k]}};
    const Spacing spacing = spacingOf(points, s.console.follow("spacing"));
    const std::string name = a.text("name");
    s.console.say(
        fmt::format("{}: from each of {} points to the nearest other it is {:.4g} in the median, {:.4g} at least", name,
                    points.size(), spacing.median, spacing.minimum));
    s.report[name] = {{"points", points.size()}, {"median", spacing.median}, {"minimum", spacing.minimum}};
}

} // namespace

std::vector<Action> pointActions() {
    return {
        {.name = "scatter",
         .group = kGroup,
         .summary = "random points in the domain of the newest flow, shape or level set",
         .inputs = "flow, shape or level set (which stays)",
         .outputs = "points",
         .takes = {maybe(stays("domain", {Kind::flow, Kind::shape, Kind::levelSet}, "grid"),
                         "with box= there may be none")},
         .makes = {made("points", {Kind::points})},
         .options = {integer("count", "10000", 1, 1e15, "how many"),
                     integer("seed", "0", 0, 0x1p53 - 1, "another seed, other points"),
                     box("box", "the box to fill (default: that of the domain)"),
                     ages("grid", "", "a level set to fill")},
         .examples = {"curlew -torus -scatter count=1e5 seed=3 -write torus.ply"},
         .run = scatterAction},
        {.name = "advect",
         .group = kGroup,
         .summary = "move the newest points along the newest flow, each on its own track",
         .inputs = "flow (which stays), points",
         .outputs = "points; with trails=1 their ways, as curves",
         .takes = {stays("flow", {Kind::flow}), changed("points", {Kind::points})},
         .makes = {made("points", {Kind::points}), made("curves", {Kind::curves}, "trails")},
         .options = {real("time", "1", "s",
                          "how long; negative runs backward; after -frames the default is from frame to frame"),
                     integer("steps", "100", 1, 1e9,
                             "steps of equal length; after -frames the default is its substeps"),
                     positive("dt", "", "s", "instead of steps: how long one is, at most"),
                     choice("scheme", {"euler", "midpoint", "rk4", "rk23"},
                            "integrator; rk23 shortens its steps until they are accurate (Bogacki-Shampine)", "rk4"),
                     positive("accuracy", "1e-4", "world units", "of rk23: the error of a step"),
                     positive("longest", "", "world units", "no step moves a point farther (default: any)"),
                     choice("reproject", {"none", "newton", "gauss-newton"},
                            "how points are kept on their track; with none, and in flows that are sums, they "
                            "drift, and cross walls",
                            "gauss-newton"),
                     positive("tolerance", "1e-8", "", "on f and g, relative to their root mean squares"),
                     integer("iterations", "10", 1, 1000, "most corrections a step"),
                     integer("halvings", "8", 0, 20, "how often a failing step is halved before the point waits"),
                     integer("jacobian", "0", 0, 1e6,
                             "for so many of the points, measure how the flow changes volumes on their way"),
                     flag("trails", "0", "1: also make curves of the ways that they go, with a vertex at each step")},
         .examples = {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn speed=1 -scatter "
                      "-advect time=2 -write points.ply"},
         .run = advectAction},
        {.name = "snap",
         .group = kGroup,
         .summary = "put the newest points onto the newest shape or level set, or where a field has a value",
         .inputs = "points; shape, level set or field (which stays)",
         .outputs = "points",
         .takes = {stays("surface", {Kind::shape, Kind::levelSet, Kind::field}), changed("points", {Kind::points})},
         .makes = {made("points", {Kind::points})},
         .options = {real("iso", "", "", "where the newest field has this value, instead of a shape or level set"),
                     positive("reach", "1", "world units", "points that are farther away stay where they are")},
         .examples = {"curlew -torus -scatter count=3000 -snap -splat look=opaque radius=0.02 -write skin.png"},
         .run = snapAction},
        {.name = "distance",
         .group = kGroup,
         .summary = "measure how far two sets of points are apart, id by id, or the vertices of curves from the other "
                    "curve of their id, and how many ids only one of the two has",
         .inputs = "2 sets of points, or of curves (which stay)",
         .outputs = "report",
         .takes = {several(stays("what", {Kind::points, Kind::curves}, "geo"), 2, 2, "both of one kind")},
         .makes = {made("report", {Kind::report})},
         .options = {ages("geo", "0,1", "which two")},
         .examples =
             {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn speed=1 -scatter -advect "
              "steps=20 -scatter -advect steps=40 -distance"},
         .run = distanceAction},
        {.name = "spacing",
         .group = kGroup,
         .summary = "measure how far the newest points are from the nearest other one each: the median and the minimum",
         .inputs = "points (which stay)",
         .outputs = "report",
         .takes = {stays("points", {Kind::points})},
         .makes = {made("report", {Kind::report})},
         .options = {text("name", "spacing", "of the figures in the report")},
         .examples = {"curlew -jitter spacing=0.1 -spacing -expect spacing/median least=0.078 most=0.085"},
         .run = spacingAction}};
}

} // namespace curlew::app
