#include "Options.h"
#include "curlew/app/Registry.h"
#include "curlew/app/Session.h"
#include "curlew/track/Jitter.h"

#include <utility>

namespace curlew::app {

namespace {

using namespace options;

/// In space: the domain of the newest flow, shape or level set, else the default box.
Domain spatialDomain(Session& s) {
    const auto field = s.newestField(true), grid = s.newestLevelSet();
    const uint64_t flow = s.flows.empty() ? 0 : s.flows.entry().made;
    const uint64_t shape = std::max(field ? s.fields.entry(*field).made : 0, grid ? s.grids.entry(*grid).made : 0);
    if (flow > shape) return s.flow().domain();
    if (shape > 0) return Domain::of({.sdf = s.newestSdf(0), .side = Side::inside});
    return {};
}

void jitterAction(Session& s, const Arguments& a) {
    if (a.given("count") && a.given("spacing")) throw ValueError("give count or spacing, not both");
    Domain domain = spatialDomain(s);
    if (a.given("box")) domain.box = a.box("box");
    const int64_t dimensions = a.given("dim") ? a.integer("dim") : s.flows.empty() ? 3 : dimensionOf(s.flows.at());
    if (domain.wall && a.given("side")) domain.wall->side = static_cast<Side>(a.choice("side"));
    JitteredLatticeOptions options{.count = static_cast<double>(a.integer("count")),
                                   .spacing = a.given("spacing") ? a.real("spacing") : 0,
                                   .amount = a.real("amount"),
                                   .random = a.choice("method") == 1,
                                   .conform = a.flag("conform"),
                                   .width = a.real("width"),
                                   .flow = {.seed = static_cast<uint64_t>(a.integer("seed")),
                                            .frequency = a.real("frequency"),
                                            .uniform = a.choice("speed") == 0}};
    if (a.given("time")) options.flow.time = a.real("time");
    const Monitor monitor = s.console.follow("jitter");
    JitteredLattice lattice = dimensions == 2 ? jitteredLattice(inPlane(domain), options, monitor)
                                              : jitteredLattice(domain, options, monitor);
    s.console.say(fmt::format("jitter: {} points at a spacing of {:.6g}{}", lattice.points.size(), lattice.spacing,
                              lattice.conforms ? ", none of which crosses the wall" : ""));
    s.report["jitter"] = {
        {"points", lattice.points.size()}, {"spacing", lattice.spacing}, {"conforms", lattice.conforms}};
    s.geometry.push(std::move(lattice.points), s.now());
}

} // namespace

std::vector<Action> jitterActions() {
    return {
        {.name = "jitter",
         .group = "points",
         .summary =
             "a lattice in the domain of the newest flow, shape or level set, moved a little by a flow of noise: "
             "irregular, well spaced points, none of which crosses the wall",
         .inputs = "flow, shape or level set (which stays), if there is one",
         .outputs = "points",
         .takes = {maybe(stays("domain", {Kind::flow, Kind::shape, Kind::levelSet}), "without one it is a box")},
         .makes = {made("points", {Kind::points})},
         .options = {integer("count", "10000", 1, 1e15, "about how many points"),
                     positive("spacing", "", "world units", "of the lattice, instead of count"),
                     integer("dim", "", 2, 3,
                             "2: a lattice in the plane z = 0 (default: as many as the newest flow has, else 3)"),
                     real("amount", "1", "",
                          "how far they move: 1 leaves about 0.82 spacings between neighbours, 0 the lattice"),
                     integer("seed", "0", 0, 0x1p53 - 1, "another seed, another flow"),
                     choice("method", {"curl", "random"},
                            "along a flow (curl-noise jittering), or each at random in its cell"),
                     positive("frequency", "0.3", "1 / spacing", "curl: of the noise"),
                     choice("speed", {"uniform", "noise"},
                            "curl: all points move equally far, or as the divergence-free flow is fast"),
                     real("time", "", "s", "curl: a moment of an animation, which passes a cell of noise each second"),
                     flag("conform", "1", "curl: keep points on their side of the wall, if there is one"),
                     positive("width", "1", "spacings", "curl: of the layer in which the flow turns along the wall"),
                     choice("side", {"inside", "outside", "both"}, "of the wall, instead of that which the flow is on"),
                     box("box", "the box to fill (default: that of the domain)")},
         .examples = {"curlew -sphere -jitter count=2000 seed=3 -write blue.ply",
                      "curlew -jitter dim=2 spacing=0.05 box=0,0,-1,4,3,1 -write dots.csv"},
         .run = jitterAction}};
}

} // namespace curlew::app
