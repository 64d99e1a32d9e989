// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "FlowInSpace.h"
#include "WallResolution.h"
#include "curlew/app/registry/Bind.h"
#include "curlew/flow/Wind.h"

namespace curlew::app {

namespace {

using namespace options;

const Binding<WindOptions>& windBinding() {
    static const auto binding =
        Binding<WindOptions>()
            .add(
                positive("speed", "", "world units / s", "speed of the wind far away"),
                [](auto& o) -> auto& { return o.speed; })
            .addOptional(
                notNegative("gusts", "", "",
                            "rms speed of the newest noise far away, relative to the wind (default: 0, which "
                            "uses no noise; 0.3 with noise=NAME)"),
                [](auto& o) -> auto& { return o.gusts; })
            .addOptional(
                notNegative("padding", "", "world units",
                            "distance by which the domain extends beyond the shape (default: half of its size)"),
                [](auto& o) -> auto& { return o.padding; });
    return binding;
}

bool hasGusts(const Arguments& a) { return a.given("gusts") && a.real("gusts") > 0; }

void wind(Context& c, const Arguments& a) {
    WindOptions options = windBinding().read(a);
    options.direction = a.vector("direction");
    if (a.given("across")) options.across = a.vector("across");
    const double width = a.given("layer") ? a.real("layer") : windWidth(c.sdf("wall", 0), options);
    const Wall wall{.sdf = c.sdf("wall", width), .side = a.choice<Side>("side"), .width = width};
    const auto noise = c.has("noise") ? std::optional(inSpace(c.field("noise").field)) : std::nullopt;
    const Flow flow = windFlow(wall, noise, options);
    Domain domain = flow.domain();
    if (a.given("box")) domain.box = a.box("box");
    requireResolution(domain);
    c.give(AnyFlow(flow.within(domain)));
}

std::vector<Option> windDeclared() {
    std::vector<Option> all = windBinding().options();
    all.insert(all.begin(), vector("direction", "1,0,0", "", "direction of the wind far away; any length"));
    all.push_back(
        vector("across", "", "",
               "direction in which the wind is deflected, to both sides (default: where the shape is narrowest)"));
    all.push_back(formerly(
        {"width"}, positive("layer", "", "world units",
                            "width of the layer in which the wind goes around the shape (default: half of the shape's "
                            "extent across; less makes the wind faster there)")));
    all.push_back(choice("side", {"inside", "outside", "both"}, "side of the shape on which the wind is", "outside"));
    all.push_back(box("box", "domain of the flow (default: the box of the shape, padded)"));
    all.push_back(keep());
    return all;
}

} // namespace

Registry windActions() {
    return {
        {.name = "wind",
         .group = "flows",
         .summary =
             "wind around the newest shape or level set (obstacle), with gusts of the newest noise; it has tracks",
         .takes = {onRequest(taken("noise", {Kind::noise}), "only with gusts= above 0", hasGusts),
                   stays("wall", {Kind::shape, Kind::levelSet})},
         .makes = {made("flow", {Kind::flow})},
         .options = windDeclared(),
         .examples = {"curlew -sphere radius=0.5 -wind direction=1,0,0 speed=1 -slice axis=z -write wind.png",
                      "curlew -noise frequency=2 -sphere radius=0.5 -wind gusts=0.4 -scatter -advect -write wind.ply"},
         .evaluation = Evaluation::anyTime,
         .run = wind,
         .makesWith = flowInSpace}};
}

} // namespace curlew::app
