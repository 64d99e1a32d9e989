#include "Options.h"
#include "curlew/app/Registry.h"
#include "curlew/app/Session.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Map.h"
#include "curlew/track/Jitter.h"

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

/// What of a domain in space lies in the plane z = 0.
DomainN<2> inPlane(const Domain& domain) {
    const auto flat = [](const Vec3d& v) { return Vec<double, 2>{{v[0], v[1]}}; };
    const auto flatBox = [&](const Box& box) { return BoxN<2>{flat(box.lower), flat(box.upper)}; };
    DomainN<2> plane{.box = flatBox(domain.box), .wall = {}};
    if (!domain.wall) return plane;
    const Sdf& sdf = domain.wall->sdf;
    plane.wall = WallN<2>{.sdf = {.distance = lifted<2>(sdf.distance, {constantField<2>(0)}),
                                  .bounds = flatBox(sdf.bounds),
                                  .reach = 0, // in the plane, the surface may be farther away than in space
                                  .steepness = sdf.steepness},
                          .side = domain.wall->side};
    return plane;
}

/// The spacing at which the lattice has about so many points of the domain.
template <int N>
double spacingFor(const DomainN<N>& domain, double count, const Monitor& monitor) {
    double volume = 1;
    for (int axis = 0; axis < N; ++axis) volume *= domain.box.size()[axis];
    const double guess = std::pow(volume / count, 1.0 / N);
    const auto there = static_cast<double>(latticePoints(domain, guess, monitor).size());
    if (there == 0) throw ValueError("no point of the lattice is in the domain; give a larger count");
    return guess * std::pow(there / count, 1.0 / N);
}

template <int N>
Particles jitteredLattice(Session& s, const Arguments& a, DomainN<N> domain) {
    if (domain.wall && a.given("side")) domain.wall->side = static_cast<Side>(a.choice("side"));
    if (!domain.box.finite()) throw ValueError("the domain is infinite; give a box");
    const Monitor monitor = s.console.follow("jitter");
    const double spacing =
        a.given("spacing") ? a.real("spacing") : spacingFor(domain, static_cast<double>(a.integer("count")), monitor);
    auto points = latticePoints(domain, spacing, monitor);
    if (points.empty()) throw ValueError("no point of the lattice is in the domain; choose a smaller spacing");
    const auto seed = static_cast<uint64_t>(a.integer("seed"));
    const bool conforms = domain.wall && a.flag("conform") && a.choice("method") == 0;
    if (domain.wall) domain.wall->width = a.real("width") * spacing;
    DomainN<N> flowDomain = domain;
    if (!conforms) flowDomain.wall.reset();
    if (a.choice("method") == 1) {
        jitterRandomly(points, spacing, a.real("amount"), seed);
    } else {
        JitterFlowOptions o{.seed = seed, .frequency = a.real("frequency"), .uniform = a.choice("speed") == 0};
        if (a.given("time")) o.time = a.real("time");
        jitter(jitterFlow(flowDomain, spacing, o), points, spacing, a.real("amount"), monitor);
    }
    s.console.say(fmt::format("jitter: {} points at a spacing of {:.6g}{}", points.size(), spacing,
                              conforms ? ", none of which crosses the wall" : ""));
    s.report["jitter"] = {{"points", points.size()}, {"spacing", spacing}, {"conforms", conforms}};
    Particles particles;
    for (const auto& p : points) {
        particles.id.push_back(static_cast<int64_t>(particles.size()));
        particles.x.push_back(p[0]), particles.y.push_back(p[1]);
        if constexpr (N == 3)
            particles.z.push_back(p[2]);
        else
            particles.z.push_back(0);
    }
    return particles;
}

void jitterAction(Session& s, const Arguments& a) {
    if (a.given("count") && a.given("spacing")) throw ValueError("give count or spacing, not both");
    Domain domain = spatialDomain(s);
    if (a.given("box")) domain.box = a.box("box");
    const int64_t dimensions = a.given("dim") ? a.integer("dim") : s.flows.empty() ? 3 : dimensionOf(s.flows.at());
    s.geometry.push(dimensions == 2 ? jitteredLattice(s, a, inPlane(domain)) : jitteredLattice(s, a, domain), s.now());
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
