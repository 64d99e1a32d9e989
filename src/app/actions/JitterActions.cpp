// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "PointsN.h"
#include "ScatterDomain.h"
#include "curlew/app/registry/Bind.h"
#include "curlew/track/Jitter.h"

#include <utility>

namespace curlew::app {

namespace {

using namespace options;

const std::vector<std::string> kCurl{"method=curl"};

const Binding<JitteredLatticeOptions>& jitterBinding() {
    static const auto binding =
        Binding<JitteredLatticeOptions>()
            .add(
                integer(
                    "count", "", 1, 1e15,
                    "number of points, as near as a lattice in the box allows: in 7D up to five times more or fewer"),
                [](auto& o) -> auto& { return o.count; })
            .addOptional(
                instead(positive("spacing", "", "world units", "spacing of the lattice, instead of count="), {"count"}),
                [](auto& o) -> auto& { return o.spacing; })
            .add(
                real("amount", "", "",
                     "amount of displacement: 1 leaves about 0.82 spacings between neighbours, 0 the lattice itself"),
                [](auto& o) -> auto& { return o.amount; })
            .add(
                integer("seed", "", 0, 0x1p53 - 1, "random seed of the flow"),
                [](auto& o) -> auto& { return o.flow.seed; })
            .add(
                choice("method", {"curl", "random"},
                       "curl: displace along a flow (curl-noise jittering); random: displace each point randomly in "
                       "its cell"),
                [](auto& o) -> auto& { return o.random; })
            .add(
                onlyWith(kCurl, positive("frequency", "", "1 / spacing", "frequency of the noise")),
                [](auto& o) -> auto& { return o.flow.frequency; })
            .add(
                onlyWith(kCurl, formerly({"speed"}, choice("displacement", {"noise", "uniform"},
                                                           "distance that points move: proportional to the "
                                                           "divergence-free flow's speed (noise), or "
                                                           "equal for all (uniform)"))),
                [](auto& o) -> auto& { return o.flow.uniform; })
            .addOptional(
                onlyWith(kCurl,
                         real("time", "", "s", "time of an animation that passes one cell of the noise per second")),
                [](auto& o) -> auto& { return o.flow.time; })
            .add(
                onlyWith(kCurl, flag("conform", "", "keep points on their side of the wall, if there is one")),
                [](auto& o) -> auto& { return o.conform; })
            .add(
                onlyWith(kCurl,
                         formerly({"width"}, positive("layer", "", "spacings",
                                                      "width of the layer in which the flow turns along the wall"))),
                [](auto& o) -> auto& { return o.width; });
    return binding;
}

/// Says and reports what jitteredPositions() or jitteredLattice() has made.
void reportJitter(Context& c, size_t points, double spacing, bool conforms) {
    c.info(fmt::format("jitter: {} points at a spacing of {:.6g}{}", points, spacing,
                       conforms ? ", none of which crosses the wall" : ""));
    c.report("jitter") = {{"points", points}, {"spacing", spacing}, {"conforms", conforms}};
}

void jitterAction(Context& c, const Arguments& a) {
    const JitteredLatticeOptions options = jitterBinding().read(a);
    const Monitor monitor = c.follow("jitter");
    const int dimensions = pointDimension(c, a, "domain");
    if (dimensions > 3) {
        if (a.given("side")) throw ValueError("side= needs a wall, which is in 2 or 3 dimensions");
        return withDimension(dimensions, [&](auto n) {
            auto made = jitteredPositions(domainOfPointsN<n>(c, a, "domain"), options, monitor);
            reportJitter(c, made.positions.size(), made.spacing, made.conforms);
            givePointsN(c, std::move(made.positions));
        });
    }
    Domain domain = c.has("domain") ? domainOfInput(c, "domain") : Domain{};
    if (a.given("box")) domain.box = a.box("box");
    if (domain.wall && a.given("side")) domain.wall->side = a.choice<Side>("side");
    JitteredLattice lattice = dimensions == 2 ? jitteredLattice(inPlane(domain), options, monitor)
                                              : jitteredLattice(domain, options, monitor);
    reportJitter(c, lattice.points.size(), lattice.spacing, lattice.conforms);
    givePoints(c, std::move(lattice.points));
}

std::vector<Option> jitterOptions() {
    std::vector<Option> all = jitterBinding().options();
    all.insert(all.begin() + 2, formerly({"dim"}, integer("dimensions", "", 2, 7,
                                                          "number of dimensions; 2: a lattice in the plane z = 0 "
                                                          "(default: as many as the newest flow has, else 3)")));
    all.push_back(choice("side", {"inside", "outside", "both"},
                         "side to fill; without side=, a flow's own side, or the inside of a shape or level set"));
    all.push_back(box("box", "box to fill; dimensions beyond z have the range of x (default: the box of the domain)"));
    return all;
}

} // namespace

Registry jitterActions() {
    return {
        {.name = "jitter",
         .group = "points",
         .summary = "jittered lattice in the newest flow, shape or level set: irregular, evenly spaced sample points",
         .takes = {maybe(stays("domain", {Kind::flow, Kind::shape, Kind::levelSet}),
                         "optional; without one, box= is filled")},
         .makes = {made("points", {Kind::points})},
         .options = jitterOptions(),
         .examples = {"curlew -sphere -jitter count=2000 seed=3 -write blue.ply",
                      "curlew -jitter dimensions=2 spacing=0.05 box=0,0,-1,4,3,1 -write dots.csv",
                      "curlew -jitter dimensions=5 count=3000 -spacing -write samples.csv"},
         .inFrames = InFrames::once,
         .run = jitterAction}};
}

} // namespace curlew::app
