// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "TrackOptions.h"
#include "curlew/track/Trace.h"

#include <numbers>

namespace curlew::app {

namespace {

using namespace options;

const Binding<TraceOptions>& traceBinding() {
    Option closure = notNegative("closure", "", "steps",
                                 "distance from its seed within which a streamline counts as closed; 0: never");
    closure.upper = 0.1;
    static const auto binding =
        Binding<TraceOptions>()
            .add(
                formerly({"by"}, choice("unit", kStepByNames,
                                        "quantity that step= and maxLength= measure, and that is equal for all steps")),
                [](auto& o) -> auto& { return o.by; })
            .addOptional(
                positive("step", "", "world units or s",
                         "step size (default: 1/200 of the diagonal of the domain's box; with unit=time, the time to "
                         "travel that at the rms speed)"),
                [](auto& o) -> auto& { return o.step; })
            .addOptional(
                formerly(
                    {"limit"},
                    positive(
                        "maxLength", "", "world units or s",
                        "maximum length or duration in each direction (default: 8 diagonals; with unit=time, the time "
                        "to travel them at the rms speed)")),
                [](auto& o) -> auto& { return o.limit; })
            .add(
                integer("vertices", "", 2, 1e9, "maximum number of vertices in each direction"),
                [](auto& o) -> auto& { return o.vertices; })
            .addOptional(
                positive("accuracy", "", "world units",
                         "maximum estimated error of a step along the track; a step with a larger error is subdivided "
                         "(default: with unit=time 1e-6 of the diagonal of the flow's box, otherwise unlimited)"),
                [](auto& o) -> auto& { return o.accuracy; })
            .add(
                formerly({"direction"}, choice("integrate", kDirectionNames,
                                               "direction in which to trace: with the flow, against it, or both")),
                [](auto& o) -> auto& { return o.direction; })
            .add(
                notNegative("stagnation", "", "", "speed at which a streamline ends, relative to the rms speed"),
                [](auto& o) -> auto& { return o.stagnation; })
            .add(
                closure, [](auto& o) -> auto& { return o.closure; })
            .include(
                reprojectionBinding(TraceOptions{}.reprojection,
                                    "method that projects vertices back onto their track; with none, and in flows that "
                                    "are sums, streamlines drift, and end at walls",
                                    "streamline ends"),
                [](auto& o) -> auto& { return o.reprojection; });
    return binding;
}

std::vector<Option> traceDeclared() {
    std::vector<Option> all = traceBinding().options();
    all.insert(all.begin() + 6, positive("turn", "15", "degrees",
                                         "maximum change of direction in one step; a step that turns by more is "
                                         "subdivided"));
    all.push_back(ages("geo", "", "points that are the seeds: 0 is the newest"));
    return all;
}

TraceOptions traceOptions(const Context& c, const Arguments& a, const Flow& flow) {
    TraceOptions o = traceBinding().read(a);
    o.turn = a.real("turn") * (std::numbers::pi / 180);
    if (!flow.hasTracks() && !a.given("reproject")) {
        o.reprojection.method = Reprojection::none;
        c.warn("the flow has no tracks: streamlines drift, end at walls, and may not close");
    }
    return o;
}

/// Returns the number of ends of each kind that occurs: "196 closed, 4 limit".
std::string endsOf(const TraceResult& result) {
    std::string text;
    for (size_t k = 0; k < kCurveEnds; ++k)
        if (const auto end = static_cast<CurveEnd>(k); end != CurveEnd::seed && result.count(end) > 0)
            text += fmt::format("{}{} {}", text.empty() ? "" : ", ", result.count(end), nameOf(end));
    return text.empty() ? "none" : text;
}

void traceAction(Context& c, const Arguments& a) {
    const Flow flow = c.flow("flow");
    TraceResult result = trace(flow, c.points("points").particles, traceOptions(c, a, flow), c.follow("trace"));
    const Curves& curves = result.curves;
    std::string line = fmt::format("trace: {} streamlines with {} vertices; ends: {}; mean length {:.4g}",
                                   curves.size(), curves.vertices(), endsOf(result), result.lengthMean);
    if (result.count(CurveEnd::closed) > 0) line += fmt::format(", closing gap at most {:.1e}", result.gapMax);
    if (flow.hasTracks()) line += fmt::format(", drift f {:.1e} g {:.1e}", result.driftRms[0], result.driftRms[1]);
    c.info(line);
    auto& report = c.report("trace") = {
        {"curves", curves.size()},        {"vertices", curves.vertices()}, {"closed", result.count(CurveEnd::closed)},
        {"gap_rms", result.gapRms},       {"gap_max", result.gapMax},      {"length_mean", result.lengthMean},
        {"length_max", result.lengthMax}, {"retries", result.retries}};
    for (size_t q = 0; q < 2 && flow.hasTracks(); ++q) {
        report[q == 0 ? "drift_f_rms" : "drift_g_rms"] = result.driftRms[q];
        report[q == 0 ? "drift_f_max" : "drift_g_max"] = result.driftMax[q];
    }
    for (size_t k = 0; k < kCurveEnds; ++k) report["ends"][nameOf(static_cast<CurveEnd>(k))] = result.ends[k];
    c.give(std::make_shared<const Curves>(std::move(result.curves)));
}

} // namespace

Registry curveActions() {
    return {{.name = "trace",
             .group = "curves",
             .summary = "trace streamlines of the newest flow from the newest points (seeds), each on its own track",
             .takes = {stays("flow", {Kind::flow}), stays("points", {Kind::points}, "geo")},
             .makes = {made("curves", {Kind::curves})},
             .options = traceDeclared(),
             .examples = {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn speed=1 -scatter "
                          "count=500 -trace -write curves.obj curves.vdb"},
             .run = traceAction}};
}

} // namespace curlew::app
