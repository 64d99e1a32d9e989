// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "TrackOptions.h"
#include "curlew/track/Trace.h"

#include <numbers>

namespace curlew::app {

namespace {

using namespace options;

const Binding<TraceOptions>& traceBinding() {
    Option closure =
        notNegative("closure", "", "steps", "a curve that passes its seed nearer than this is closed; 0: none is");
    closure.upper = 0.1;
    static const auto binding =
        Binding<TraceOptions>()
            .add(
                choice("by", kStepByNames, "what the steps are equal in"), [](auto& o) -> auto& { return o.by; })
            .addOptional(
                positive("step", "", "world units or s",
                         "how long a step is (default: a 200th of the diagonal of the domain's box, at the rms "
                         "speed)"),
                [](auto& o) -> auto& { return o.step; })
            .addOptional(
                positive("limit", "", "world units or s",
                         "how far a curve goes in each direction (default: 8 diagonals, at the rms speed)"),
                [](auto& o) -> auto& { return o.limit; })
            .add(
                integer("vertices", "", 2, 1e9, "most vertices in each direction"),
                [](auto& o) -> auto& { return o.vertices; })
            .addOptional(
                positive("accuracy", "", "world units",
                         "a step whose estimated error along the track is larger is taken in parts (default: with "
                         "by=time a millionth of the diagonal of the flow's box, else any)"),
                [](auto& o) -> auto& { return o.accuracy; })
            .add(
                choice("direction", kDirectionNames, "with the flow, against it, or both ways"),
                [](auto& o) -> auto& { return o.direction; })
            .add(
                notNegative("stagnation", "", "", "a curve ends at this speed, relative to the rms speed"),
                [](auto& o) -> auto& { return o.stagnation; })
            .add(
                closure, [](auto& o) -> auto& { return o.closure; })
            .include(
                reprojectionBinding(
                    TraceOptions{}.reprojection,
                    "how curves are kept on their track; with none, and in flows that are sums, they drift, and end "
                    "at walls",
                    "curve ends"),
                [](auto& o) -> auto& { return o.reprojection; });
    return binding;
}

std::vector<Option> traceDeclared() {
    std::vector<Option> all = traceBinding().options();
    all.insert(all.begin() + 6, positive("turn", "15", "degrees", "a step that turns by more is taken in parts"));
    all.push_back(ages("geo", "", "which points, the newest being 0"));
    return all;
}

TraceOptions traceOptions(const Context& c, const Arguments& a, const Flow& flow) {
    TraceOptions o = traceBinding().read(a);
    o.turn = a.real("turn") * (std::numbers::pi / 180);
    if (!flow.hasTracks() && !a.given("reproject")) {
        o.reprojection.method = Reprojection::none;
        c.warn("this flow is a sum and has no tracks: curves drift, end at walls, and may not close");
    }
    return o;
}

/// "196 closed, 4 limit": how many ends there are of each kind that occurs.
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
    std::string line = fmt::format("trace: {} curves of {} vertices, ends: {}; mean length {:.4g}", curves.size(),
                                   curves.vertices(), endsOf(result), result.lengthMean);
    if (result.count(CurveEnd::closed) > 0) line += fmt::format(", gaps at most {:.1e}", result.gapMax);
    if (flow.hasTracks()) line += fmt::format(", drift f {:.1e} g {:.1e}", result.driftRms[0], result.driftRms[1]);
    c.say(line);
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
             .summary =
                 "streamlines of the newest flow from the newest points, each on its own track, closed where they "
                 "come back",
             .takes = {stays("flow", {Kind::flow}), stays("points", {Kind::points}, "geo")},
             .makes = {made("curves", {Kind::curves})},
             .options = traceDeclared(),
             .examples = {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn speed=1 -scatter "
                          "count=500 -trace -write curves.obj curves.vdb"},
             .run = traceAction}};
}

} // namespace curlew::app
