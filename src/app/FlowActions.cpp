#include "Options.h"
#include "curlew/app/Registry.h"
#include "curlew/app/Session.h"
#include "curlew/field/Map.h"
#include "curlew/flow/Flows.h"
#include "curlew/flow/Reshape.h"

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
        {bounded(inSpace(noise.field), wall, options), fmt::format("{} of ({})", a.program(), noise.program), {}, wall},
        s.now());
}

/// DeWolf's product of the newest noise and the newest distance.
void blend(Session& s, const Arguments& a) {
    const auto noiseAge = s.newestField(false);
    if (!noiseAge) throw ValueError("there is no noise to blend; make one with -noise");
    const double range = a.real("range");
    const Wall wall{.sdf = s.newestSdf(range), .side = static_cast<Side>(a.choice("side")), .width = range};
    const FieldObject noise = a.flag("keep") ? s.fields.at(*noiseAge) : s.fields.take(*noiseAge);
    s.fields.push({productBounded(inSpace(noise.field), wall.sdf, range),
                   fmt::format("{} of ({})", a.program(), noise.program),
                   {},
                   wall},
                  s.now());
}

/// Takes the `count` newest fields, the oldest of them first.
std::vector<FieldObject> takeFields(Session& s, const Arguments& a, size_t count, const std::string& what) {
    if (s.fields.size() < count)
        throw ValueError(fmt::format("needs {}, and there {} {}; make them with -noise, -bound or a shape", what,
                                     s.fields.size() == 1 ? "is" : "are",
                                     s.fields.empty()       ? "none"
                                     : s.fields.size() == 1 ? "one"
                                                            : std::to_string(s.fields.size())));
    std::vector<FieldObject> fields;
    for (size_t age = count; age-- > 0;) fields.push_back(s.fields.at(age));
    for (size_t k = 0; k < count && !a.flag("keep"); ++k) s.fields.take();
    return fields;
}

/// The wall that bounds one of the fields, if there is one.
std::optional<Wall> wallOf(const std::vector<FieldObject>& fields) {
    std::optional<Wall> wall;
    for (const auto& field : fields) {
        if (!field.wall) continue;
        if (wall)
            throw ValueError(
                "two of the fields are bounded by a wall, and the flow would stand still at it; bound one of them");
        wall = field.wall;
    }
    return wall;
}

/// The options that all flows have.
std::vector<Option> paceOptions(std::vector<Option> own = {}) {
    own.push_back(positive("speed", "", "world units / s",
                           "scale the flow to this root mean square speed over its domain (default: as it comes)"));
    own.push_back(flag("normalize", "0",
                       "1: the same speed everywhere; the flow keeps its tracks but is no longer divergence-free"));
    own.push_back(box("box", "the domain (default: the box of the wall; without a wall -1,-1,-1,1,1,1)"));
    return own;
}

/// Pushes a flow of any dimension at the pace that the options ask for.
template <int N>
void pushFlow(Session& s, const Arguments& a, const FlowN<N>& flow) {
    const Monitor monitor = s.console.follow("measuring the speed");
    const double now = magnitudesOf(flow, monitor).speed, speed = a.given("speed") ? a.real("speed") : now;
    const FlowN<N> paced = withSpeed(flow, speed, monitor); // also where the speed stays as it is: a flow has to move
    s.flows.push(a.flag("normalize") ? flow.normalized(speed) : paced, s.now());
}

/// The domain of a flow in space.
Domain domainOf(const Arguments& a, const std::optional<Wall>& wall = {}, double padding = -1) {
    Domain domain;
    if (wall) domain = Domain::of(*wall, padding);
    if (a.given("box")) domain.box = a.box("box");
    return domain;
}

/// N - 1 fields of N dimensions, and not 3.
template <int N>
void dfvnInDimension(Session& s, const Arguments& a) {
    const auto fields =
        takeFields(s, a, N - 1, fmt::format("{} field{} of {} dimensions", N - 1, N == 2 ? "" : "s", N));
    typename FlowN<N>::Potentials potentials = [&]<size_t... K>(std::index_sequence<K...>) {
        const auto potential = [&](const FieldObject& object) {
            if (const auto* field = std::get_if<ScalarFieldN<N>>(&object.field)) return *field;
            throw ValueError(fmt::format("the newest field has {} dimensions, so it needs {} of them, and one has {}",
                                         N, N - 1, dimensionOf(object.field)));
        };
        return typename FlowN<N>::Potentials{potential(fields[K])...};
    }
    (std::make_index_sequence<size_t{N - 1}>());
    DomainN<N> domain;
    if (a.given("box")) {
        if (N != 2) throw ValueError("box= is for 2 and 3 dimensions; in others the domain is the cube from -1 to 1");
        const Box box = a.box("box");
        for (int i = 0; i < std::min(N, 2); ++i) {
            domain.box.lower[i] = box.lower[i];
            domain.box.upper[i] = box.upper[i];
        }
    }
    pushFlow(s, a, FlowN<N>(std::move(potentials), domain));
}

void dfvn(Session& s, const Arguments& a) {
    if (!s.fields.empty()) {
        switch (dimensionOf(s.fields.at().field)) {
            case 2:
                // A second field in space makes it one of those: f and g.
                if (s.fields.size() < 2 || dimensionOf(s.fields.at(1).field) != 3) return dfvnInDimension<2>(s, a);
                break;
            case 4:
                return dfvnInDimension<4>(s, a);
            case 5:
                return dfvnInDimension<5>(s, a);
            case 6:
                return dfvnInDimension<6>(s, a);
            case 7:
                return dfvnInDimension<7>(s, a);
            default:
                break;
        }
    }
    const auto fields = takeFields(s, a, 2, "two fields, f and g");
    Domain domain = domainOf(a, wallOf(fields), a.given("padding") ? a.real("padding") : -1);
    // On a surface: g is a distance, and every one of its level sets has a flow of its own.
    if (fields[1].sdf && !a.given("box") && !domain.wall && fields[1].sdf->bounds.finite()) {
        const Box& shape = fields[1].sdf->bounds;
        const Vec3d size = shape.size();
        domain.box = shape.padded(0.1 * std::max({size[0], size[1], size[2]}));
    }
    pushFlow(s, a, Flow(inSpace(fields[0].field), inSpace(fields[1].field), domain));
}

/// Flow on a surface: f, and the newest shape or level set as g.
void surface(Session& s, const Arguments& a) {
    const auto noiseAge = s.newestField(false);
    if (!noiseAge) throw ValueError("there is no field that could flow on the surface; make one with -noise");
    const double reach = a.real("reach");
    const Sdf sdf = s.newestSdf(reach);
    const FieldObject noise = a.flag("keep") ? s.fields.at(*noiseAge) : s.fields.take(*noiseAge);
    Domain domain;
    if (a.given("box"))
        domain.box = a.box("box");
    else if (sdf.bounds.finite())
        domain.box = sdf.bounds.padded(reach);
    pushFlow(s, a, Flow(inSpace(noise.field), sdf.distance, domain));
}

void curl(Session& s, const Arguments& a) {
    const double offset = a.real("offset");
    const auto fields =
        takeFields(s, a, offset > 0 ? 1 : 3, offset > 0 ? "a noise" : "three noises; or one, with offset=100");
    const Domain domain = domainOf(a, wallOf(fields));
    const size_t second = fields.size() > 1 ? 1 : 0, third = fields.size() > 1 ? 2 : 0;
    const auto flow = std::visit(
        [&](const auto& first) -> Flow {
            using Field = std::remove_cvref_t<decltype(first)>;
            if constexpr (Field::kDimension == 2 || Field::kDimension == 3) {
                const auto moved = [&](size_t k, int axis) {
                    const auto* field = std::get_if<Field>(&fields[k].field);
                    if (!field) throw ValueError("the three noises must all have 2 or all have 3 dimensions");
                    PlacementN<Field::kDimension> placement;
                    if (axis >= 0) placement.offset[axis] = -offset;
                    return placed(*field, placement);
                };
                return curlFlow(std::array{moved(0, -1), moved(second, 0), moved(third, 1)}, domain);
            } else {
                throw ValueError("curl noise is made of noises of 3 dimensions, or of 2 (three of them: cheaper)");
            }
        },
        fields[0].field);
    pushFlow(s, a, flow);
}

void reshape(Session& s, const Arguments& a) {
    const Flow flow = s.flow();
    ReshapeOptions options{.softness = a.real("softness")};
    if (a.given("limit")) options.limit = a.real("limit");
    if (a.given("f")) options.f = a.interval("f");
    if (a.given("g")) options.g = a.interval("g");
    if (!a.given("limit") && !a.given("f") && !a.given("g")) throw ValueError("give limit=, f= or g=");
    const Flow slower = reshaped(flow, options, s.console.follow("reshape"));
    if (!a.flag("keep")) s.flows.take();
    s.flows.push(slower, s.now());
}

void addFlows(Session& s, const Arguments& a) {
    if (s.flows.size() < 2) throw ValueError("needs two flows; make them with -dfvn, -curl, -uniform, …");
    const Flow second = s.flow(0), first = s.flow(1);
    if (!a.flag("keep")) {
        s.flows.take();
        s.flows.take();
    }
    // The one with the wall decides on the domain.
    const Domain domain = first.domain().wall || !second.domain().wall ? first.domain() : second.domain();
    s.flows.push((first + second).within(domain), s.now());
}

Action simpleFlow(std::string name, std::string summary, std::vector<Option> options, std::string example,
                  Flow (*make)(const Arguments&, const Domain&)) {
    options.push_back(box("box", "the domain"));
    return {.name = std::move(name),
            .group = kGroup,
            .summary = std::move(summary),
            .outputs = "flow",
            .makes = {made("flow", {Kind::flow})},
            .options = std::move(options),
            .examples = {std::move(example)},
            .run = [make](Session& s, const Arguments& a) { s.flows.push(make(a, domainOf(a)), s.now()); }};
}

std::vector<Action> wallActions() {
    return {
        {.name = "bound",
         .group = kGroup,
         .summary = "make the newest noise conform to the newest signed distance (Eq. 13)",
         .inputs = "field, and a shape or level set (which stays)",
         .outputs = "field",
         .takes = {taken("noise", {Kind::noise}, "field"), stays("wall", {Kind::shape, Kind::levelSet}, "grid")},
         .makes = {made("field", {Kind::field})},
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
        {.name = "blend",
         .group = kGroup,
         .summary = "the newest noise times the newest distance, clipped (DeWolf's way to conform to a wall)",
         .inputs = "field, and a shape or level set (which stays)",
         .outputs = "field",
         .takes = {taken("noise", {Kind::noise}), stays("wall", {Kind::shape, Kind::levelSet})},
         .makes = {made("field", {Kind::field})},
         .options = {positive("range", "0.5", "world units", "beyond it the distance no longer matters"),
                     choice("side", {"inside", "outside", "both"}, "where the flow is"), keep()},
         .examples = {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -blend range=0.3 -dfvn speed=1 "
                      "-slice -write dewolf.png"},
         .run = blend}};
}

std::vector<Action> potentialActions() {
    return {
        {.name = "dfvn",
         .group = kGroup,
         .summary = "the newest two fields f, g become the flow grad f x grad g; in n dimensions the newest n - 1",
         .inputs = "2 fields; or 1 of 2 dimensions, or n - 1 of n",
         .outputs = "flow",
         .takes = {taken("f", {Kind::field}), maybe(taken("g", {Kind::field}), "in 2 dimensions there is none"),
                   several(taken("more", {Kind::field}), 0, 4, "in n dimensions n - 3")},
         .makes = {made("flow", {Kind::flow})},
         .options = paceOptions({notNegative("padding", "", "world units",
                                             "how far the domain reaches around an obstacle (default: half its size)"),
                                 keep()}),
         .examples =
             {"curlew -noise frequency=2 -noise frequency=2 seed=1 -dfvn speed=1 -velocity voxel=0.02 -write vel.vdb",
              "curlew -noise dim=2 frequency=2 octaves=3 -dfvn -slice -write swirls.png"},
         .run = dfvn},
        {.name = "surface",
         .group = kGroup,
         .summary = "the newest noise flows on the newest shape or level set, and on its parallels",
         .inputs = "field, and a shape or level set (which stays)",
         .outputs = "flow",
         .takes = {taken("noise", {Kind::noise}), stays("surface", {Kind::shape, Kind::levelSet})},
         .makes = {made("flow", {Kind::flow})},
         .options =
             paceOptions({positive("reach", "0.2", "world units", "how far from the surface the flow goes"), keep()}),
         .examples = {"curlew -torus -noise frequency=3 -surface speed=1 -velocity voxel=0.02 -write skin.vdb"},
         .run = surface},
        {.name = "curl",
         .group = kGroup,
         .summary =
             "classical curl noise of the newest three noises, of 3 dimensions or (cheaper) of 2; it has no tracks",
         .inputs = "3 fields; or 1, with offset=",
         .outputs = "flow",
         .takes = {taken("x", {Kind::field}), maybe(taken("y", {Kind::field}), "with offset= above 0 there is none"),
                   maybe(taken("z", {Kind::field}), "with offset= above 0 there is none")},
         .makes = {made("flow", {Kind::flow})},
         .options = paceOptions({notNegative("offset", "0", "world units",
                                             "above 0: take one noise three times, moved by so much (Catlike: 100)"),
                                 keep()}),
         .examples = {"curlew -noise frequency=2 -curl offset=100 speed=1 -velocity voxel=0.02 -write curl.vdb",
                      "curlew -noise dim=2 -noise dim=2 seed=1 -noise dim=2 seed=2 -curl -velocity -write cheap.vdb"},
         .run = curl}};
}

std::vector<Action> otherActions() {
    return {
        {.name = "reshape",
         .group = kGroup,
         .summary = "slow streamlines of the newest flow down, or stop them; it stays divergence-free",
         .inputs = "flow with tracks",
         .outputs = "flow",
         .takes = {taken("flow", {Kind::flow})},
         .makes = {made("flow", {Kind::flow})},
         .options = {positive("limit", "", "world units / s", "no streamline goes faster"),
                     interval("f", "", "only streamlines with f in this interval move"),
                     interval("g", "", "only streamlines with g in this interval move"),
                     {.name = "softness",
                      .type = OptionType::real,
                      .fallback = "0.25",
                      .help = "over this part of an interval, at each end, they fade in",
                      .lower = 0,
                      .upper = 0.5},
                     keep()},
         .examples = {"curlew -noise frequency=2 -noise frequency=2 seed=1 -dfvn speed=1 -reshape limit=1.5 -slice "
                      "-write limited.png"},
         .run = reshape},
        {.name = "superpose",
         .group = kGroup,
         .summary = "the sum of the newest two flows; it is divergence-free, but has no tracks",
         .inputs = "2 flows",
         .outputs = "flow",
         .takes = {taken("first", {Kind::flow}), taken("second", {Kind::flow})},
         .makes = {made("flow", {Kind::flow})},
         .options = {keep()},
         .examples = {"curlew -noise -noise seed=1 -dfvn speed=1 -uniform velocity=0,1,0 -superpose -velocity "
                      "-write wind.vdb"},
         .run = addFlows},
        simpleFlow("uniform", "the same velocity everywhere",
                   {vector("velocity", "0,1,0", "world units / s", "the velocity")},
                   "curlew -uniform velocity=1,0,0 -velocity -write wind.vdb",
                   [](const Arguments& a, const Domain& domain) { return uniformFlow(a.vector("velocity"), domain); }),
        simpleFlow("vortex", "a vortex about the y axis, like a rigid body near it and slower away from it",
                   {real("turns", "1", "1 / s", "at the axis"),
                    positive("core", "0.3", "world units", "where half of the turning speed is left")},
                   "curlew -vortex turns=0.5 -slice axis=y -write vortex.png",
                   [](const Arguments& a, const Domain& domain) {
                       return vortexFlow(a.real("turns"), a.real("core"), domain);
                   }),
        simpleFlow("updraft", "a column that rises along y at speed / (1 + y / height), and spreads; it has no tracks",
                   {real("speed", "1", "world units / s", "at y = 0"),
                    positive("height", "1", "world units", "where half of it is left")},
                   "curlew -noise -noise seed=1 -dfvn speed=0.5 -updraft -superpose -velocity -write smoke.vdb",
                   [](const Arguments& a, const Domain& domain) {
                       return updraftFlow(a.real("speed"), a.real("height"), domain);
                   })};
}

} // namespace

std::vector<Action> flowActions() {
    std::vector<Action> actions = wallActions();
    for (auto* group : {&potentialActions, &otherActions})
        for (auto& action : group()) actions.push_back(std::move(action));
    return actions;
}

} // namespace curlew::app
