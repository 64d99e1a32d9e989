// SPDX-License-Identifier: Apache-2.0
// Longer than 400 lines: one action for each kind of flow, most of it declarations of options.
#include "Actions.h"
#include "FlowInSpace.h"
#include "WallResolution.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Transforms.h"
#include "curlew/flow/FlowScale.h"
#include "curlew/flow/Flows.h"
#include "curlew/flow/Reshape.h"
#include "curlew/track/FlowAtWall.h"
#include "curlew/track/Scatter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

namespace curlew::app {

namespace {

using namespace options;

const std::string kFlowGroup = "flows";

/// Returns all fields that an action takes, in the order of its inputs.
std::vector<FieldValue> fieldsOf(const Context& c, const Action& action) {
    std::vector<FieldValue> fields;
    for (const Input& input : action.takes)
        for (size_t k = 0; k < c.count(input.name); ++k) fields.push_back(c.field(input.name, k));
    return fields;
}

/// Returns the wall that one of the fields conforms to, if there is one.
std::optional<AnyWall> wallOf(const std::vector<FieldValue>& fields) {
    std::optional<AnyWall> wall;
    for (const auto& field : fields) {
        if (!field.wall) continue;
        if (wall)
            throw ValueError(
                "two of the fields are bounded by a wall, so the flow would be zero at it; bound only one of them");
        wall = field.wall;
    }
    return wall;
}

/// Returns the wall that the vector potentials must conform to: the wall of the bounded ones among them. If their
/// layers differ in width, the widest counts, since all potentials are ramped in the same way.
std::optional<Wall> wallOfPotentials(const std::vector<FieldValue>& fields) {
    std::optional<Wall> widest;
    for (const auto& field : fields) {
        if (!field.wall) continue;
        const Wall wall = inSpace(*field.wall);
        if (widest && (wall.side != widest->side || wall.sdf.bounds.center() != widest->sdf.bounds.center()))
            throw ValueError(
                "the three noises are bounded by different walls, or on different sides; bound only one of them");
        if (!widest || wall.width > widest->width) widest = wall;
    }
    return widest;
}

/// Returns a flow's own options, followed by those that all flows have.
std::vector<Option> paceOptions(std::vector<Option> own = {}) {
    own.push_back(positive("speed", "", "world units / s",
                           "rms speed over the domain to which the flow is scaled (default: not scaled)"));
    own.push_back(
        formerly({"normalize"},
                 flag("uniformSpeed", "0",
                      "1: scale the velocity to the same speed everywhere; streamlines keep their shape, but the flow "
                      "is no longer divergence-free")));
    own.push_back(box("box",
                      "domain of the flow (default: the box of the wall or surface, padded unless the flow is inside "
                      "the wall, or of a grid; without one -1,-1,-1,1,1,1)"));
    return own;
}

/// Outputs a flow with the speed that the options specify. `now`: its rms speed, if that is not the one over its
/// domain.
template <int N>
void giveFlow(Context& c, const Arguments& a, const FlowN<N>& flow, std::optional<double> now = {}) {
    requireResolution(flow.domain());
    if (!now) now = movingSpeedOf(flow, c.follow("measuring the speed"));
    const double speed = a.given("speed") ? a.real("speed") : *now;
    c.give(AnyFlow(a.flag("uniformSpeed") ? flow.normalized(speed)
                   : speed != *now        ? scaled(flow, speed / *now)
                                          : flow));
}

/// Returns the domain of a 3D flow.
Domain domainOf(const Arguments& a, const std::optional<Wall>& wall = {}, double padding = -1) {
    Domain domain;
    if (wall) domain = Domain::of(*wall, padding);
    if (a.given("box")) domain.box = a.box("box");
    return domain;
}

double paddingOf(const Arguments& a) { return a.given("padding") ? a.real("padding") : -1; }

/// Returns the flow, with onLevelSets=1 the one that preserves the area of the level sets of its newest potential.
template <int N>
FlowN<N> onLevelSets(const Arguments& a, const FlowN<N>& flow) {
    return a.flag("onLevelSets") ? flow.onLevelSets() : flow;
}

/// Makes a flow from N - 1 fields of N dimensions, for N other than 3.
template <int N>
void dfvnInDimension(Context& c, const Arguments& a) {
    const auto fields = fieldsOf(c, a.action());
    typename FlowN<N>::Potentials potentials = [&]<size_t... K>(std::index_sequence<K...>) {
        const auto potential = [&](const FieldValue& value) {
            if (const auto* field = std::get_if<ScalarFieldN<N>>(&value.field)) return *field;
            throw ValueError(
                fmt::format("the newest field has {} dimensions, so {} such fields are needed, but one has {}", N,
                            N - 1, dimensionOf(value.field)));
        };
        return typename FlowN<N>::Potentials{potential(fields.at(K))...};
    }
    (std::make_index_sequence<size_t{N - 1}>());
    DomainN<N> domain;
    if constexpr (N == 2)
        if (const auto wall = wallOf(fields)) domain = DomainN<2>::of(std::get<WallN<2>>(*wall), paddingOf(a));
    if (a.given("box")) {
        if (N != 2)
            throw ValueError("box= is only for 2 and 3 dimensions; in others the domain is the cube from -1 to 1");
        const Box box = a.box("box");
        for (int i = 0; i < std::min(N, 2); ++i) {
            domain.box.lower[i] = box.lower[i];
            domain.box.upper[i] = box.upper[i];
        }
    }
    giveFlow(c, a, onLevelSets(a, FlowN<N>(std::move(potentials), domain)));
}

/// Returns how many fields a flow needs, depending on the dimension of the newest field. A newest field of 2 dimensions
/// makes a 2D flow by itself, or a 3D flow together with a preceding 3D field.
size_t fieldsForFlow(const Scope& scope) {
    const auto newest = scope.newest({Kind::field});
    if (!newest || newest->dimension == 3 || newest->dimension < 2) return 2;
    if (newest->dimension > 3) return static_cast<size_t>(newest->dimension - 1);
    const auto before = scope.second({Kind::field});
    return before && before->dimension == 3 ? 2 : 1;
}

/// Declares the input for the potentials of a flow with indices from `first` (inclusive) to `last` (exclusive).
Input potentialInput(std::string name, size_t first, size_t last, std::string help) {
    Input input = several(taken(std::move(name), {Kind::field}), first == 0 ? 1 : 0, last - first, std::move(help));
    input.potential = true;
    input.amountWith = [first, last](const Arguments&, const Scope& scope) {
        const size_t wanted = fieldsForFlow(scope), count = std::min(wanted, last) - std::min(wanted, first);
        return Amount{count, count};
    };
    return input;
}

/// Returns the box of the grids among the potentials of a flow: where they overlap. There is no flow beyond.
std::optional<Box> boxOfGrids(const std::vector<FieldValue>& potentials) {
    std::optional<Box> common;
    for (const FieldValue& field : potentials) {
        if (!field.sampled) continue;
        const Box box = field.sampled->box;
        if (!common) common = box;
        for (int axis = 0; axis < 3; ++axis) {
            common->lower[axis] = std::max(common->lower[axis], box.lower[axis]);
            common->upper[axis] = std::min(common->upper[axis], box.upper[axis]);
            if (!(common->lower[axis] < common->upper[axis])) return std::nullopt;
        }
    }
    return common;
}

/// Returns the box around the surface of which g is the distance. The flow follows it and all other level sets of g.
std::optional<Box> boxAlong(const FieldValue& g) {
    const auto shape = g.sdf ? boxOf(*g.sdf) : std::nullopt;
    if (!shape) return std::nullopt;
    const Vec3d size = shape->size();
    return shape->padded(0.1 * std::max({size[0], size[1], size[2]}));
}

/// Throws ValueError if f and g are the same noise and one of them is bound to a wall. The flow would only move in the
/// layer.
void requireDifferent(const Context& c, const FieldValue& f, const FieldValue& g, const Box& box) {
    if (!f.free && !g.free) return;
    const auto noise = [](const FieldValue& field) { return inSpace(field.free ? *field.free : field.field); };
    try {
        movingSpeedOf(Flow(noise(f), noise(g), Domain{.box = box, .wall = {}}), c.follow("comparing the noises"));
    } catch (const ValueError&) {
        throw ValueError(
            "f and g are the same noise, so the flow would only move in the layer of the wall; use two different "
            "fields (seeds)");
    }
}

void dfvn(Context& c, const Arguments& a) {
    const size_t count = c.count("f") + c.count("g") + c.count("more");
    if (count == 1) return dfvnInDimension<2>(c, a);
    if (count > 2) {
        switch (count) {
            case 3:
                return dfvnInDimension<4>(c, a);
            case 4:
                return dfvnInDimension<5>(c, a);
            case 5:
                return dfvnInDimension<6>(c, a);
            default:
                return dfvnInDimension<7>(c, a);
        }
    }
    const auto fields = fieldsOf(c, a.action());
    const auto wall = wallOf(fields);
    Domain domain = domainOf(a, wall ? std::optional(inSpace(*wall)) : std::nullopt, paddingOf(a));
    if (!a.given("box") && !domain.wall)
        if (const auto box = boxAlong(fields[1]), grid = boxOfGrids(fields); box || grid)
            domain.box = box ? *box : *grid;
    requireDifferent(c, fields[0], fields[1], domain.box);
    giveFlow(c, a, onLevelSets(a, Flow(inSpace(fields[0].field), inSpace(fields[1].field), domain)));
}

/// Returns how far from a surface its flow extends: a fraction of the surface's size, if the size is finite.
double surfaceExtent(const Context& c, const Arguments& a) {
    constexpr double kPart = 0.06, kOfUnbounded = 0.2;
    if (a.given("extent")) return a.real("extent");
    const auto box = boxOf(c.value("surface"));
    return box ? kPart * length(box->size()) : kOfUnbounded;
}

/// Returns the rms speed of a flow on a surface. Throws ValueError if it is 0.
double speedOn(const Sdf& surface, const Flow& flow, const Monitor& monitor) {
    constexpr size_t kSamples = 4096;
    const Domain domain{.box = flow.domain().box,
                        .wall = Wall{.sdf = surface, .side = Side::both, .width = length(flow.domain().box.size())}};
    Points points = scatterFrom(domain, 0, kSamples, {.on = ScatterOn::surface}, monitor);
    double squares = 0;
    for (size_t k = 0; k < points.size(); ++k) {
        const Vec3d v = flow.at(points.position(k)).velocity;
        squares += dot(v, v);
    }
    const double speed = std::sqrt(squares / static_cast<double>(points.size()));
    if (!(speed > 0)) throw ValueError("the flow does not move on the surface");
    return speed;
}

/// A flow along a surface: f is the noise, g the distance of a shape or level set. The distance of a level set is only
/// known within its narrow band, so it is clipped at `extent`. The flow then ends there, and never samples the end of
/// the band, where the velocity would jump.
void surface(Context& c, const Arguments& a) {
    const double extent = surfaceExtent(c, a);
    const Sdf sdf = c.sdf("surface", extent);
    Domain domain;
    if (a.given("box"))
        domain.box = a.box("box");
    else if (sdf.bounds.finite())
        domain.box = sdf.bounds.padded(extent);
    const ScalarField noise = inSpace(c.field("noise").field);
    if (c.kind("surface") != Kind::levelSet) return giveFlow(c, a, Flow(noise, sdf.distance, domain));
    const Flow fading(noise, clipped(sdf.distance, extent), domain);
    if (!a.given("speed") && !a.flag("uniformSpeed")) return giveFlow(c, a, fading);
    giveFlow(c, a, fading, speedOn(sdf, fading, c.follow("measuring the speed")));
}

/// Classical curl noise. With a wall, this ramps the noises themselves, not the fields that -bound made from them.
void curl(Context& c, const Arguments& a) {
    const double shift = a.real("shift");
    const auto fields = fieldsOf(c, a.action());
    Domain domain = domainOf(a, wallOfPotentials(fields));
    if (const auto grid = boxOfGrids(fields); grid && !a.given("box") && !domain.wall) domain.box = *grid;
    const auto noise = [&](size_t k) -> const AnyField& {
        return fields.at(k).free ? *fields[k].free : fields[k].field;
    };
    const size_t second = fields.size() > 1 ? 1 : 0, third = fields.size() > 1 ? 2 : 0;
    const auto flow = std::visit(
        [&](const auto& first) -> Flow {
            using Field = std::remove_cvref_t<decltype(first)>;
            if constexpr (Field::kDimension == 2 || Field::kDimension == 3) {
                const auto moved = [&](size_t k, int axis) {
                    const auto* field = std::get_if<Field>(&noise(k));
                    if (!field) throw ValueError("the three noises must all have 2 or all have 3 dimensions");
                    PlacementN<Field::kDimension> placement;
                    if (axis >= 0) placement.offset[axis] = -shift;
                    return placed(*field, placement);
                };
                return curlFlow(std::array{moved(0, -1), moved(second, 0), moved(third, 1)}, domain);
            } else {
                throw ValueError("needs noises of 3 dimensions, or three noises of 2 (cheaper)");
            }
        },
        noise(0));
    giveFlow(c, a, flow);
}

void reshape(Context& c, const Arguments& a) {
    ReshapeOptions options{.softness = a.real("softness")};
    if (a.given("maxSpeed")) options.limit = a.real("maxSpeed");
    if (a.given("f")) options.f = a.interval("f");
    if (a.given("g")) options.g = a.interval("g");
    if (!a.given("maxSpeed") && !a.given("f") && !a.given("g")) throw ValueError("needs maxSpeed=, f= or g=");
    c.give(AnyFlow(reshaped(c.flow("flow"), options, c.follow("reshape"))));
}

/// Warns, once and not in every frame, if a sum crosses its wall.
void warnOfCrossing(const Context& c, const Flow& sum, size_t termsOfFirst) {
    if (!sum.domain().wall || !sum.domain().box.finite()) return;
    if (std::exchange(c.memory().object, std::make_shared<bool>(true))) return;
    constexpr size_t kSamples = 500;
    const auto monitor = c.follow("checking the sum at the wall");
    try {
        if (flowAtWall(sum, kSamples, monitor).tangent()) return;
    } catch (const ValueError&) {
        return; // an empty domain
    }
    const SumAtWall at = sumAtWall(sum, kSamples, monitor);
    std::array<double, 2> crossing{}; // of the first flow and of the second
    for (size_t k = 0; k < at.terms.size(); ++k) {
        double& most = crossing[k < termsOfFirst ? 0 : 1];
        most = std::max(most, at.terms[k].flux * at.terms[k].speed);
    }
    c.warn(
        fmt::format("the {} flow crosses the wall of the other, at up to {:.2g} times the rms speed of the sum, so the "
                    "sum does not go around the wall and points stop there; bound that flow too (-bound before "
                    "-dfvn), or use -wind instead of a uniform or rising one",
                    crossing[1] >= crossing[0] ? "newer" : "older", at.whole.flux));
}

void addFlows(Context& c, const Arguments&) {
    const Flow first = c.flow("first"), second = c.flow("second");
    // The flow with a wall determines the domain. If both have walls, the narrower layer is used to judge steps.
    Domain domain = first.domain().wall || !second.domain().wall ? first.domain() : second.domain();
    if (first.domain().wall && second.domain().wall)
        domain.wall->width = std::min(domain.wall->width, second.domain().wall->width);
    const Flow sum = (first + second).within(domain);
    warnOfCrossing(c, sum, first.terms().size());
    c.give(AnyFlow(sum));
}

Action simpleFlow(std::string name, std::string summary, std::vector<Option> options, std::string example,
                  Flow (*make)(const Arguments&, const Domain&)) {
    options.push_back(box("box", "domain of the flow (default: -1,-1,-1,1,1,1)"));
    return {.name = std::move(name),
            .group = kFlowGroup,
            .summary = std::move(summary),
            .makes = {made("flow", {Kind::flow})},
            .options = std::move(options),
            .examples = {std::move(example)},
            .evaluation = Evaluation::anyTime,
            .run = [make](Context& c, const Arguments& a) { c.give(AnyFlow(make(a, domainOf(a)))); }};
}

/// An action for a flow about the y axis that can be placed anywhere. By default, its domain is around where it is.
Action placeableFlow(const std::string& name, const std::string& summary, std::vector<Option> options,
                     const std::string& example, Flow (*make)(const Arguments&, const Domain&)) {
    options.push_back(vector("translate", "0,0,0", "world units", "position of the flow's origin"));
    options.push_back(vector("rotate", "0,0,0", "degrees", "rotation about x, then y, then z"));
    Action action = simpleFlow(name, summary, std::move(options), example, nullptr);
    action.options.back().help = "domain of the flow (default: one unit around translate=)";
    action.run = [make](Context& c, const Arguments& a) {
        const Placement placement{.offset = a.vector("translate"), .rotate = a.vector("rotate")};
        Domain domain = domainOf(a);
        if (!a.given("box")) domain.box = {domain.box.lower + placement.offset, domain.box.upper + placement.offset};
        const Flow flow = make(a, domain);
        c.give(AnyFlow(placement == Placement{} ? flow : placed(flow, placement)));
    };
    return action;
}

Registry potentialActions() {
    const auto ofPotential = [](Input input) {
        input.potential = true;
        return input;
    };
    const auto ofThree = [](const Arguments& a) { return !(a.real("shift") > 0); };
    return {
        {.name = "dfvn",
         .group = kFlowGroup,
         .summary = "divergence-free vector noise (DFVN): flow grad f x grad g of the newest two fields (in n "
                    "dimensions: of the newest n - 1)",
         .details = "A shape that is the wall of another field (-bound, -blend) is left out if there are enough fields "
                    "without it.",
         .takes = {potentialInput("f", 0, 1, ""), potentialInput("g", 1, 2, "not used in 2 dimensions"),
                   potentialInput("more", 2, 6, "a flow in n dimensions takes n - 1 fields of n dimensions")},
         .makes = {made("flow", {Kind::flow})},
         .options = paceOptions(
             {notNegative("padding", "", "world units",
                          "distance by which the domain extends beyond an obstacle (default: half of its size)"),
              instead(flag("onLevelSets", "0",
                           "1: divide by |grad g| (g: the newest field), so that points on a level set of g stay "
                           "evenly spread: divergence-free with respect to its area, not to the volume"),
                      {"uniformSpeed"}),
              keep()}),
         .examples =
             {"curlew -noise frequency=2 -noise frequency=2 seed=1 -dfvn speed=1 -velocity voxel=0.02 -write vel.vdb",
              "curlew -noise dimensions=2 frequency=2 octaves=3 -dfvn -slice -write swirls.png",
              "curlew -noise frequency=2 -formula 'x^2+2*y^2+3*z^2' -dfvn onLevelSets=1 -scatter count=1000 -advect "
              "-write ellipsoids.ply"},
         .evaluation = Evaluation::anyTime,
         .run = dfvn},
        {.name = "surface",
         .group = kFlowGroup,
         .summary = "flow on a surface: the newest noise on the newest shape or level set, and on its offset surfaces",
         .details = "Around a level set, speed= is the rms speed on the surface, since the flow fades out beyond it.",
         .takes = {taken("noise", {Kind::noise}), stays("surface", {Kind::shape, Kind::levelSet})},
         .makes = {made("flow", {Kind::flow})},
         .options = paceOptions(
             {formerly(
                  {"reach"},
                  positive("extent", "", "world units",
                           "distance from the surface to which the flow extends; around a level set, "
                           "the flow fades to zero towards that distance (default: 6 % of the diagonal of its box)")),
              keep()}),
         .examples = {"curlew -torus -noise frequency=3 -surface speed=1 -velocity voxel=0.02 -write skin.vdb"},
         .evaluation = Evaluation::anyTime,
         .run = surface,
         .makesWith = flowInSpace},
        {.name = "curl",
         .group = kFlowGroup,
         .summary = "classical curl noise of the newest three noises (3D, or 2D: cheaper), without tracks; if one is "
                    "bounded, all are",
         .takes = {ofPotential(
                       several(taken("x", {Kind::field}), 1, 1, "with shift=, the only noise, used three times")),
                   ofPotential(
                       onlyIf(taken("y", {Kind::field}), "not with shift=, which uses one noise three times", ofThree)),
                   ofPotential(onlyIf(taken("z", {Kind::field}), "not with shift=, which uses one noise three times",
                                      ofThree))},
         .makes = {made("flow", {Kind::flow})},
         .options = paceOptions(
             {formerly(
                  {"offset"},
                  notNegative("shift", "0", "world units",
                              "shift between the three copies of a single noise (Catlike: 100); 0: take three noises")),
              keep()}),
         .examples = {"curlew -noise frequency=2 -curl shift=100 speed=1 -velocity voxel=0.02 -write curl.vdb",
                      "curlew -noise dimensions=2 -noise dimensions=2 seed=1 -noise dimensions=2 seed=2 -curl "
                      "-velocity -write cheap.vdb",
                      "curlew -sphere -noise frequency=2 -bound -curl shift=100 speed=1 -velocity -write ball.vdb"},
         .evaluation = Evaluation::anyTime,
         .run = curl,
         .makesWith = flowInSpace}};
}

Registry otherActions() {
    return {
        {.name = "reshape",
         .group = kFlowGroup,
         .summary = "slow down or stop streamlines of the newest flow by maxSpeed=, f= or g=; it stays divergence-free",
         .takes = {taken("flow", {Kind::flow})},
         .makes = {made("flow", {Kind::flow})},
         .options = {formerly({"limit"}, positive("maxSpeed", "", "world units / s",
                                                  "maximum speed; a faster streamline is slowed down as a whole")),
                     interval("f", "", "interval of f: only streamlines with f in it move"),
                     interval("g", "", "interval of g: only streamlines with g in it move"),
                     {.name = "softness",
                      .type = OptionType::real,
                      .fallback = fmt::format("{}", ReshapeOptions{}.softness),
                      .help = "fraction of an interval, at each end, over which the speed fades in",
                      .lower = 0,
                      .upper = 0.5},
                     keep()},
         .examples = {"curlew -noise frequency=2 -noise frequency=2 seed=1 -dfvn speed=1 -reshape maxSpeed=1.5 -slice "
                      "-write limited.png"},
         .evaluation = Evaluation::anyTime,
         .run = reshape,
         .makesWith = flowInSpace},
        {.name = "superpose",
         .group = kFlowGroup,
         .summary = "sum (superposition) of the newest two flows; -advect can follow its terms separately (splitting=)",
         .takes = {taken("first", {Kind::flow}), taken("second", {Kind::flow})},
         .makes = {made("flow", {Kind::flow})},
         .options = {keep()},
         .examples = {"curlew -noise -noise seed=1 -dfvn speed=1 -uniform velocity=0,1,0 -superpose -velocity "
                      "-write wind.vdb"},
         .evaluation = Evaluation::anyTime,
         .run = addFlows,
         .makesWith = flowInSpace},
        simpleFlow("uniform", "uniform flow: the same velocity everywhere",
                   {vector("velocity", "0,1,0", "world units / s", "velocity")},
                   "curlew -uniform velocity=1,0,0 -velocity -write wind.vdb",
                   [](const Arguments& a, const Domain& domain) { return uniformFlow(a.vector("velocity"), domain); }),
        placeableFlow(
            "vortex", "vortex about the y axis: a rigid rotation near the axis, slower farther away",
            {real("turns", "1", "1 / s", "revolutions per second at the axis"),
             positive("core", "0.3", "world units", "distance from the axis at which the angular velocity is halved")},
            "curlew -vortex turns=0.5 core=2 translate=50,0,20 rotate=0,0,15 box=40,0,10,60,30,30 -velocity -write "
            "tornado.vdb",
            [](const Arguments& a, const Domain& domain) {
                return vortexFlow(a.real("turns"), a.real("core"), domain);
            }),
        placeableFlow(
            "updraft", "rising column along y that spreads as it slows down; a sum of two terms",
            {real("speed", "1", "world units / s",
                  "vertical speed at its origin; above it speed / (1 + s), below it speed (1 - s + s²), where s = "
                  "height / "
                  "halfHeight"),
             formerly({"height"}, positive("halfHeight", "1", "world units", "height at which the speed is halved"))},
            "curlew -noise -noise seed=1 -dfvn speed=0.5 -updraft -superpose -velocity -write smoke.vdb",
            [](const Arguments& a, const Domain& domain) {
                return updraftFlow(a.real("speed"), a.real("halfHeight"), domain);
            }),
        {.name = "enright",
         .group = kFlowGroup,
         .summary = "deformation field of Enright's test: a time-dependent flow that returns every point to its start",
         .makes = {made("flow", {Kind::flow})},
         .options = {formerly({"period"},
                              positive("loop", "3", "s", "period after which every point is back at its start"))},
         .examples = {"curlew -enright -slice -write enright.png"},
         .evaluation = Evaluation::anyTime,
         .varies = true,
         .run = [](Context& c, const Arguments& a) {
             c.give(AnyFlow(enrightFlowInTime(a.real("loop")).at(c.moment().time)));
         }}};
}

} // namespace

Registry flowActions() {
    Registry actions = potentialActions();
    for (auto& action : otherActions()) actions.push_back(std::move(action));
    return actions;
}

} // namespace curlew::app
