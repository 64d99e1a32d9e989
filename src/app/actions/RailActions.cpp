// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "FlowInSpace.h"
#include "curlew/app/registry/Bind.h"
#include "curlew/flow/RailFlow.h"

namespace curlew::app {

namespace {

using namespace options;

const Binding<RailFlowOptions>& railBinding() {
    static const auto binding =
        Binding<RailFlowOptions>()
            .add(
                positive("radius", "", "world units", "radius of the tubes around the curves"),
                [](auto& o) -> auto& { return o.radius; })
            .add(
                real("speed", "", "world units / s", "speed on the curves; negative: against their direction"),
                [](auto& o) -> auto& { return o.speed; })
            .add(
                choice("profile", kRailProfileNames,
                       "plug: the same speed throughout the tubes, which must not touch; smooth: the speed falls to "
                       "zero at the surface of the tubes, and where tubes meet, the flows add"),
                [](auto& o) -> auto& { return o.profile; });
    return binding;
}

/// Returns the points of a curve.
std::vector<Vec3d> pointsOf(const Curves& curves, size_t curve) {
    std::vector<Vec3d> points;
    for (size_t v = curves.start[curve]; v < curves.start[curve + 1]; ++v) points.push_back(curves.position(v));
    return points;
}

void rail(Context& c, const Arguments& a) {
    const CurvesPointer curves = c.curves("curves");
    std::vector<RailPointer> rails;
    for (size_t k = 0; k < curves->size(); ++k) {
        const std::vector<Vec3d> points = pointsOf(*curves, k);
        if (points.size() < 2) continue; // a seed that did not move
        rails.push_back(std::make_shared<const Rail>(points, curves->closed(k), a.real("twist")));
    }
    if (rails.empty())
        throw ValueError("no curve has two points, so there is nothing to follow; draw curves of at least two points");
    const RailFlowOptions options = railBinding().read(a);
    Flow flow = railFlow(rails, options);
    if (a.given("box")) {
        Domain domain = flow.domain();
        domain.box = a.box("box");
        flow = flow.within(domain);
    }
    const Sdf tubes = flow.domain().wall->sdf;
    c.give(AnyFlow(flow));
    if (a.flag("tubes")) c.give(FieldValue{.field = tubes.distance, .sdf = tubes});
}

} // namespace

Registry railActions() {
    std::vector<Option> options = railBinding().options();
    options.push_back(real("twist", "0", "1 / world unit", "number of turns of the flow about the curves"));
    options.push_back(flag("tubes", "0", "1: also make the tubes, as a shape, to which noise can be bound"));
    options.push_back(box("box", "domain of the flow (default: the box of the tubes)"));
    options.push_back(keep());
    return {
        {.name = "rail",
         .group = "flows",
         .summary = "flow along drawn curves, inside a tube around each, which no particle leaves",
         .details =
             "A smooth curve goes through the points of each polyline. f and g are coordinates across the curve, so "
             "a particle keeps its distance from it, whatever the step. Open curves go on straight beyond their "
             "ends. Add detail with -superpose and a noise that is bound to the tubes (tubes=1). Read curves from "
             ".obj (lines), .csv (curve,x,y,z) or .bgeo, or make them with -trace.",
         .takes = {taken("curves", {Kind::curves})},
         .makes = {made("flow", {Kind::flow}), made("tubes", {Kind::shape}, "tubes")},
         .options = std::move(options),
         .examples =
             {"curlew -vortex -scatter count=3 box=0.3,-0.1,-0.1,0.5,0.1,0.1 -trace maxLength=1 -rail radius=0.05 "
              "profile=smooth -velocity dim=64 -write rails.vdb"},
         .evaluation = Evaluation::anyTime,
         .run = rail}};
}

} // namespace curlew::app
