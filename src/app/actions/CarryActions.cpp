// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "curlew/app/registry/Bind.h"
#include "curlew/flow/Carried.h"

namespace curlew::app {

namespace {

using namespace options;

const Binding<CarryOptions>& carryBinding() {
    static const auto binding =
        Binding<CarryOptions>()
            .add(
                formerly({"time"}, real("duration", "", "s",
                                        "advection time; negative runs against the flow. Keep it shorter than one "
                                        "turn of the flow's eddies")),
                [](auto& o) -> auto& { return o.time; })
            .add(
                integer("steps", "", 1, 1000,
                        "number of RK4 steps; more steps follow the flow map more closely. A "
                        "flow made of the carried noise is divergence-free for any number"),
                [](auto& o) -> auto& { return o.steps; });
    return binding;
}

void carry(Context& c, const Arguments& a) {
    const CarryOptions options = carryBinding().read(a);
    const AnyFlow& flow = c.anyFlow("flow");
    c.give(FieldValue{std::visit(
        [&](const auto& field) -> AnyField {
            constexpr int kN = std::remove_cvref_t<decltype(field)>::kDimension;
            if (dimensionOf(flow) != kN)
                throw ValueError(
                    fmt::format("a {}-dimensional flow cannot carry a {}-dimensional field", dimensionOf(flow), kN));
            if constexpr (kN == 2 || kN == 3)
                return carried(field, std::get<FlowN<kN>>(flow), options);
            else
                throw ValueError(fmt::format("only 2D and 3D fields can be carried, not {}D", kN));
        },
        c.field("noise").field)});
}

} // namespace

Registry carryActions() {
    std::vector<Option> options = carryBinding().options();
    options.push_back(keep());
    return {{.name = "carry",
             .group = "flows",
             .summary = "carry the newest noise along the newest flow (advected octaves), with exact derivatives",
             .takes = {taken("noise", {Kind::noise}), stays("flow", {Kind::flow})},
             .makes = {made("field", {Kind::field})},
             .options = std::move(options),
             .examples = {"curlew -noise type=sine dimensions=2 -dfvn keep=1 -noise dimensions=2 frequency=4 "
                          "amplitude=0.2 -carry duration=0.1 "
                          "-sum -dfvn -slice -write carried.png"},
             .evaluation = Evaluation::anyTime,
             .run = carry}};
}

} // namespace curlew::app
