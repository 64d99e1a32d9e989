#include "Options.h"
#include "curlew/app/Registry.h"
#include "curlew/app/Session.h"
#include "curlew/base/Memory.h"
#include "curlew/track/Scatter.h"

#include <utility>

namespace curlew::app {

namespace {

using namespace options;

const std::string kGroup = "points";

/// Where to scatter: what is asked for, else the domain of the newest flow, shape or level set.
Domain scatterDomain(Session& s, const Arguments& a) {
    const auto inside = [](const Sdf& sdf) { return Domain::of({.sdf = sdf, .side = Side::inside}); };
    Domain domain;
    if (a.given("grid")) {
        domain = inside(s.levelSetSdf(a.ages("grid").front(), 0));
    } else if (!a.given("box") || !s.flows.empty()) {
        const auto field = s.newestField(true), grid = s.newestLevelSet();
        const uint64_t flow = s.flows.empty() ? 0 : s.flows.entry().made;
        const uint64_t shape = std::max(field ? s.fields.entry(*field).made : 0, grid ? s.grids.entry(*grid).made : 0);
        if (s.flows.empty() || flow < shape)
            domain = inside(s.newestSdf(0));
        else
            domain = s.flow().domain();
    }
    if (a.given("box")) domain.box = a.box("box");
    return domain;
}

void scatterAction(Session& s, const Arguments& a) {
    const auto count = static_cast<size_t>(a.integer("count"));
    const Domain domain = scatterDomain(s, a);
    requireMemory(static_cast<double>(count) * Particles::kBytes, fmt::format("{} points", count), "scatter fewer");
    s.geometry.push(scatter(domain, count, static_cast<uint64_t>(a.integer("seed")), s.console.follow("scatter")),
                    s.now());
}

void advectAction(Session& s, const Arguments& a) {
    Particles& particles = s.particles();
    const Flow flow = s.flow();
    AdvectOptions options{.time = a.real("time"),
                          .steps = static_cast<int>(a.integer("steps")),
                          .scheme = static_cast<Scheme>(a.choice("scheme")),
                          .reprojection = static_cast<Reprojection>(a.choice("reproject")),
                          .tolerance = a.real("tolerance"),
                          .iterations = static_cast<int>(a.integer("iterations")),
                          .halvings = static_cast<int>(a.integer("halvings"))};
    if (!flow.hasTracks() && !a.given("reproject")) {
        options.reprojection = Reprojection::none;
        s.console.warn("this flow is a sum and has no tracks: points drift, and may cross walls");
    }
    const uint64_t made = s.flows.entry().made;
    if (std::exchange(s.trackedFlow, made) != made)
        for (auto* track : {&particles.f, &particles.g}) track->clear(); // of another flow
    const AdvectResult result = advect(flow, particles, options, s.console.follow("advect"));
    s.console.say(
        fmt::format("advect: {} points, {:.3g} corrections a step, residuals f {:.1e} g {:.1e}, {} steps redone, {} "
                    "points not converged, {} outside",
                    result.points, result.meanIterations, result.residual[0], result.residual[1], result.retries,
                    result.notConverged, result.outside));
    s.report["advect"] = {{"points", result.points},
                          {"substeps", result.substeps},
                          {"retries", result.retries},
                          {"kept_back", result.keptBack},
                          {"not_converged", result.notConverged},
                          {"iterations_mean", result.meanIterations},
                          {"residual_f", result.residual[0]},
                          {"residual_g", result.residual[1]},
                          {"outside", result.outside}};
}

} // namespace

std::vector<Action> pointActions() {
    return {{.name = "scatter",
             .group = kGroup,
             .summary = "random points in the domain of the newest flow, shape or level set",
             .inputs = "flow, shape or level set (which stays)",
             .outputs = "points",
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
             .outputs = "points",
             .options = {real("time", "1", "s", "how long; negative runs backward"),
                         integer("steps", "100", 1, 1e9, "steps of equal length"),
                         choice("scheme", {"euler", "midpoint", "rk4"}, "integrator", "rk4"),
                         choice("reproject", {"none", "newton", "gauss-newton"},
                                "how points are kept on their track; with none, and in flows that are sums, they "
                                "drift, and cross walls",
                                "gauss-newton"),
                         positive("tolerance", "1e-8", "", "on f and g, relative to their root mean squares"),
                         integer("iterations", "10", 1, 1000, "most corrections a step"),
                         integer("halvings", "8", 0, 20, "how often a failing step is halved before the point waits")},
             .examples = {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn speed=1 -scatter "
                          "-advect time=2 -write points.ply"},
             .run = advectAction}};
}

} // namespace curlew::app
