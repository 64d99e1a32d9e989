#include "Options.h"
#include "curlew/app/Registry.h"
#include "curlew/app/Session.h"
#include "curlew/track/Trace.h"

#include <numbers>

namespace curlew::app {

namespace {

using namespace options;

TraceOptions traceOptions(Session& s, const Arguments& a, const Flow& flow) {
    TraceOptions o{.by = static_cast<StepBy>(a.choice("by")),
                   .vertices = static_cast<size_t>(a.integer("vertices")),
                   .direction = static_cast<Direction>(a.choice("direction")),
                   .turn = a.real("turn") * (std::numbers::pi / 180),
                   .stagnation = a.real("stagnation"),
                   .closure = a.real("closure"),
                   .reprojection = {.method = static_cast<Reprojection>(a.choice("reproject")),
                                    .tolerance = a.real("tolerance"),
                                    .iterations = static_cast<int>(a.integer("iterations")),
                                    .maxSubdivisions = static_cast<int>(a.integer("halvings"))}};
    if (a.given("step")) o.step = a.real("step");
    if (a.given("limit")) o.limit = a.real("limit");
    if (!flow.hasTracks() && !a.given("reproject")) {
        o.reprojection.method = Reprojection::none;
        s.console.warn("this flow is a sum and has no tracks: curves drift, and may not close");
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

void traceAction(Session& s, const Arguments& a) {
    const Particles& seeds = s.particles(a.given("geo") ? a.ages("geo").front() : 0);
    const Flow flow = s.flow();
    TraceResult result = trace(flow, seeds, traceOptions(s, a, flow), s.console.follow("trace"));
    const Curves& curves = result.curves;
    std::string line = fmt::format("trace: {} curves of {} vertices, ends: {}; mean length {:.4g}", curves.size(),
                                   curves.vertices(), endsOf(result), result.lengthMean);
    if (result.count(CurveEnd::closed) > 0) line += fmt::format(", gaps at most {:.1e}", result.gapMax);
    if (flow.hasTracks()) line += fmt::format(", drift f {:.1e} g {:.1e}", result.driftRms[0], result.driftRms[1]);
    s.console.say(line);
    auto& report = s.report["trace"] = {
        {"curves", curves.size()},        {"vertices", curves.vertices()}, {"closed", result.count(CurveEnd::closed)},
        {"gap_rms", result.gapRms},       {"gap_max", result.gapMax},      {"length_mean", result.lengthMean},
        {"length_max", result.lengthMax}, {"retries", result.retries}};
    for (size_t q = 0; q < 2 && flow.hasTracks(); ++q) {
        report[q == 0 ? "drift_f_rms" : "drift_g_rms"] = result.driftRms[q];
        report[q == 0 ? "drift_f_max" : "drift_g_max"] = result.driftMax[q];
    }
    for (size_t k = 0; k < kCurveEnds; ++k) report["ends"][nameOf(static_cast<CurveEnd>(k))] = result.ends[k];
    s.geometry.push(std::make_shared<const Curves>(std::move(result.curves)), s.now());
}

} // namespace

std::vector<Action> curveActions() {
    return {
        {.name = "trace",
         .group = "curves",
         .summary = "streamlines of the newest flow from the newest points, each on its own track, closed where they "
                    "come back",
         .inputs = "flow, points (which stay)",
         .outputs = "curves",
         .takes = {stays("flow", {Kind::flow}), stays("points", {Kind::points}, "geo")},
         .makes = {made("curves", {Kind::curves})},
         .options = {choice("by", {"length", "time"}, "what the steps are equal in"),
                     positive("step", "", "world units or s",
                              "how long a step is (default: a 200th of the diagonal of the domain's box, at the rms "
                              "speed)"),
                     positive("limit", "", "world units or s",
                              "how far a curve goes in each direction (default: 8 diagonals, at the rms speed)"),
                     integer("vertices", "100000", 2, 1e9, "most vertices in each direction"),
                     choice("direction", {"forward", "backward", "both"}, "with the flow, against it, or both ways"),
                     positive("turn", "15", "degrees", "a step that turns by more is taken in parts"),
                     notNegative("stagnation", "1e-3", "", "a curve ends at this speed, relative to the rms speed"),
                     Option{.name = "closure",
                            .type = OptionType::real,
                            .fallback = "1e-3",
                            .help = "a curve that passes its seed nearer than this is closed; 0: none is",
                            .unit = "steps",
                            .lower = 0,
                            .upper = 0.1},
                     choice("reproject", {"none", "newton", "gauss-newton"},
                            "how curves are kept on their track; with none, and in flows that are sums, they drift",
                            "gauss-newton"),
                     positive("tolerance", "1e-9", "", "on f and g, relative to their root mean squares"),
                     integer("iterations", "10", 1, 1000, "most corrections a step"),
                     integer("halvings", "8", 0, 20, "how often a failing step is halved before the curve ends"),
                     ages("geo", "", "which points, the newest being 0")},
         .examples = {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn speed=1 -scatter "
                      "count=500 -trace -write curves.obj curves.vdb"},
         .run = traceAction}};
}

} // namespace curlew::app
