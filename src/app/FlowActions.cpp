#include "Options.h"
#include "curlew/app/Registry.h"
#include "curlew/app/Session.h"

namespace curlew::app {

namespace {

using namespace options;

const std::string kGroup = "flows";

void bound(Session& s, const Arguments& a) {
    const std::optional<size_t> noiseAge =
        a.given("field") ? std::optional(a.ages("field").front()) : s.newestField(false);
    if (!noiseAge) throw ValueError("there is no noise to bound; make one with -noise");
    const double width = a.real("width");
    const Wall wall{.sdf = a.given("grid") ? s.levelSetSdf(a.ages("grid").front(), width) : s.newestSdf(width),
                    .side = static_cast<Side>(a.choice("side")),
                    .width = width};
    const FieldObject noise = a.flag("keep") ? s.fields.at(*noiseAge) : s.fields.take(*noiseAge);
    BoundOptions options{.separate = a.flag("separate")};
    if (a.given("amplitude")) options.amplitude = a.real("amplitude");
    s.fields.push(
        {bounded(noise.field, wall, options), fmt::format("{} of ({})", a.program(), noise.program), {}, wall},
        s.now());
}

void dfvn(Session& s, const Arguments& a) {
    if (s.fields.size() < 2)
        throw ValueError(
            fmt::format("needs two fields, f and g, and there {} {}; make them with -noise, -bound or a shape",
                        s.fields.size() == 1 ? "is" : "are", s.fields.empty() ? "none" : "one"));
    const FieldObject g = s.fields.at(0), f = s.fields.at(1);
    if (!a.flag("keep")) {
        s.fields.take();
        s.fields.take();
    }
    Domain domain;
    if (g.wall && f.wall)
        throw ValueError("both fields are bounded by a wall, and the flow would stand still at it; bound one of them");
    if (const auto& wall = g.wall ? g.wall : f.wall)
        domain = Domain::of(*wall, a.given("padding") ? a.real("padding") : -1);
    if (a.given("box")) domain.box = a.box("box");
    const Dfvn flow(f.field, g.field, domain);
    const Monitor monitor = s.console.follow("measuring the speed");
    const double speed = a.given("speed") ? a.real("speed") : magnitudesOf(flow, monitor).speed;
    s.flows.push(withSpeed(flow, speed, monitor), s.now()); // also where the speed stays: a flow has to move
}

} // namespace

std::vector<Action> flowActions() {
    return {
        {.name = "bound",
         .group = kGroup,
         .summary = "make the newest noise conform to the newest signed distance (Eq. 13)",
         .inputs = "field, and a shape or level set (which stays)",
         .outputs = "field",
         .options = {positive("width", "0.1", "world units",
                              "depth of the layer in which the flow turns along the wall"),
                     choice("side", {"inside", "outside", "both"},
                            "where the flow is: contained, around an obstacle, or on both sides"),
                     flag("separate", "1",
                          "keep the noise's values on each side of the wall apart, so that none is found on the other"),
                     notNegative("amplitude", "", "world units",
                                 "the noise is scaled to this size; 0 leaves it as it is (default: the width)"),
                     ages("field", "", "which field is the noise (default: the newest that is no distance)"),
                     ages("grid", "", "which level set is the wall (default: the newest shape or level set)"), keep()},
         .examples = {"curlew -read bunny.obj -mesh2ls -noise -noise seed=1 -bound width=0.05 -dfvn speed=1 -velocity "
                      "-write vel.vdb"},
         .run = bound},
        {.name = "dfvn",
         .group = kGroup,
         .summary = "the newest two fields f, g become the flow grad f x grad g",
         .inputs = "2 fields",
         .outputs = "flow",
         .options = {positive("speed", "", "world units / s",
                              "scale the flow to this root mean square speed over its domain (default: as it comes)"),
                     notNegative("padding", "", "world units",
                                 "how far the domain reaches around an obstacle (default: half its size)"),
                     box("box", "the domain (default: the box of the wall; without a wall -1,-1,-1,1,1,1)"), keep()},
         .examples =
             {"curlew -noise frequency=2 -noise frequency=2 seed=1 -dfvn speed=1 -velocity voxel=0.02 -write vel.vdb"},
         .run = dfvn}};
}

} // namespace curlew::app
