// SPDX-License-Identifier: Apache-2.0
#include "LoopAction.h"

#include "curlew/app/run/Context.h"
#include "curlew/track/Loop.h"

namespace curlew::app {

namespace {

/// Returns the looped points, which are kept since they do not depend on the moment.
std::shared_ptr<const LoopedPoints> loopedPoints(const Context& c, const LoopOptions& o, const Monitor& monitor) {
    const FlowInTime flow = c.flowInTime("flow");
    if (!flow.steady())
        throw ValueError(
            "loop= needs a steady flow, but this one changes with time, so its tracks do not lead back; remove T from "
            "its options");
    if (!c.steady("points"))
        throw ValueError(
            "loop= needs points that stay the same from frame to frame; put the actions that make or change them "
            "before -frames");
    const auto& r = o.reprojection;
    const Digest key = DigestBuilder()
                           .add("looped points")
                           .add(c.keyOf("flow"))
                           .add(c.keyOf("points"))
                           .add(o.duration)
                           .add(o.accuracy)
                           .add(static_cast<int>(r.method))
                           .add(r.tolerance)
                           .add(r.iterations)
                           .add(r.maxSubdivisions)
                           .digest();
    return c.kept<LoopedPoints>(key, [&] {
        auto made = std::make_shared<const LoopedPoints>(flow.at(0), c.points("points").particles, o, monitor);
        const LoopSummary& s = made->summary();
        c.info(fmt::format(
            "advect: of {} points, {} follow closed tracks in {:.6g} s, at {:.3g} to {:.3g} times their speed (mean "
            "{:.3g}); {} fade, {} are at rest; {} vertices",
            s.points, s.closed, o.duration, s.paceMin, s.paceMax, s.paceMean, s.fading, s.still, s.vertices));
        if (s.coarse > 0) c.warn(fmt::format("{} steps exceed the requested error; use a larger accuracy=", s.coarse));
        return made;
    });
}

} // namespace

void loopAction(Context& c, const Arguments& a, const ReprojectionOptions& reprojection) {
    const auto loops = loopedPoints(c,
                                    {.duration = a.real("loop"),
                                     .accuracy = a.given("accuracy") ? a.real("accuracy") : 0,
                                     .reprojection = reprojection},
                                    c.follow("loop"));
    LoopMoment moment = loops->at(a.real("duration"), c.follow("advect"));
    const LoopSummary& s = loops->summary();
    c.info(fmt::format("advect: {} points on their loops, {} on the wrong side of the wall{}", s.points, moment.outside,
                       c.madeFromLevelSet("flow") ? " (a level set)" : ""));
    c.report("advect") = {{"points", s.points},
                          {"speed_max", moment.points.maxSpeed()},
                          {"outside", moment.outside},
                          {"outside_most", moment.outside},
                          {"not_converged", moment.snapped}};
    c.report("loop") = {{"points", s.points},       {"closed", s.closed},       {"faded", s.fading},
                        {"still", s.still},         {"pace_mean", s.paceMean},  {"pace_min", s.paceMin},
                        {"pace_max", s.paceMax},    {"gap_max", s.gapMax},      {"vertices", s.vertices},
                        {"bytes", s.bytes},         {"coarse", s.coarse},       {"stuck", s.stuck},
                        {"truncated", s.truncated}, {"snapped", moment.snapped}};
    PointSet set{.particles = std::move(moment.points), .tracked = c.tracked("flow")};
    set.nextId = c.points("points").nextId;
    c.give(std::make_shared<PointSet>(std::move(set)));
}

} // namespace curlew::app
