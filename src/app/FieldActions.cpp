#include "Options.h"
#include "curlew/app/Registry.h"
#include "curlew/app/Session.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Map.h"

namespace curlew::app {

namespace {

using namespace options;

const std::string kGroup = "fields";

/// Calls `make` with `dim` as a std::integral_constant.
template <int N = 1, class Make>
AnyField inDimension(int dim, const Make& make) {
    if constexpr (N < 7)
        if (dim != N) return inDimension<N + 1>(dim, make);
    return make(std::integral_constant<int, N>());
}

/// Takes the two newest fields and pushes what `combine(older, newer)` makes of them.
template <class Combine>
void combineFields(Session& s, const Arguments& a, const Combine& combine) {
    if (s.fields.size() < 2) throw ValueError("needs two fields; make them with -noise, -ramp, -constant or a shape");
    const FieldObject second = s.fields.at(0), first = s.fields.at(1);
    AnyField made = combine(first.field, second.field);
    if (!a.flag("keep")) {
        s.fields.take();
        s.fields.take();
    }
    s.fields.push({std::move(made), fmt::format("{} of ({}) and ({})", a.program(), first.program, second.program)},
                  s.now());
}

/// An action that makes one field of two, of any dimension.
template <class Combine>
Action combiningAction(const std::string& name, const std::string& summary, const std::string& example, Combine combine,
                       std::vector<Option> options = {}) {
    options.push_back(keep());
    return {.name = name,
            .group = kGroup,
            .summary = summary,
            .inputs = "2 fields",
            .outputs = "field",
            .takes = {taken("first", {Kind::field}), taken("second", {Kind::field})},
            .makes = {made("field", {Kind::field})},
            .options = std::move(options),
            .examples = {example},
            .run = [combine](Session& s, const Arguments& a) {
                combineFields(s, a, [&](const AnyField& p, const AnyField& q) {
                    return combined(p, q, [&](const auto& f, const auto& g) { return combine(f, g, a); });
                });
            }};
}

Option smoothing() {
    return notNegative("smoothing", "0.1", "",
                       "differences below which the corner is rounded, C²; with 0 it is a kink");
}

/// Takes the newest field and pushes what `map` makes of it.
template <class Map>
void mapField(Session& s, const Arguments& a, const Map& map) {
    const FieldObject old = s.fields.at();
    AnyField made = std::visit([&](const auto& f) -> AnyField { return map(f); }, old.field);
    if (!a.flag("keep")) s.fields.take();
    s.fields.push({std::move(made), fmt::format("{} of ({})", a.program(), old.program)}, s.now());
}

void transform(Session& s, const Arguments& a) {
    const std::optional<Sdf> sdf = s.fields.at().sdf;
    mapField(s, a, [&](const auto& field) {
        constexpr int kN = std::remove_cvref_t<decltype(field)>::kDimension;
        return placed(field, PlacementN<kN>{.offset = a.coordinates<kN>("offset"),
                                            .rotate = a.vector("rotate"),
                                            .scale = a.coordinates<kN>("scale")});
    });
    // A distance stays one if all axes are scaled alike.
    if (!sdf) return;
    const auto scale = a.coordinates<3>("scale");
    if (!(scale[0] > 0) || scale[0] != scale[1] || scale[0] != scale[2]) return;
    FieldObject& moved = s.fields.at();
    moved.sdf = placed(*sdf, {.offset = a.coordinates<3>("offset"), .rotate = a.vector("rotate"), .scale = scale});
    moved.field = moved.sdf->distance;
}

/// The newest field on the graph of one or two functions below it.
void lift(Session& s, const Arguments& a) {
    const auto count = static_cast<size_t>(a.integer("functions"));
    if (s.fields.size() < count + 1)
        throw ValueError(fmt::format("needs a field and {} to put it on the graph of, below it", count));
    const FieldObject high = s.fields.at();
    const int wanted = dimensionOf(high.field) - static_cast<int>(count);
    for (size_t k = 1; k <= count; ++k)
        if (const int n = dimensionOf(s.fields.at(k).field); n != wanted)
            throw ValueError(
                fmt::format("the newest field has {} dimensions, so the graph needs functions of {}, and the "
                            "field of age {} has {}",
                            dimensionOf(high.field), wanted, k, n));
    const AnyField made = std::visit(
        [&](const auto& field) -> AnyField {
            constexpr int kM = std::remove_cvref_t<decltype(field)>::kDimension;
            const auto graph = [&](auto dimension, size_t age) {
                return std::get<ScalarFieldN<decltype(dimension)::value>>(s.fields.at(age).field);
            };
            if constexpr (kM >= 2)
                if (count == 1) return lifted<kM - 1>(field, {graph(std::integral_constant<int, kM - 1>(), 1)});
            if constexpr (kM >= 3)
                if (count == 2) {
                    constexpr std::integral_constant<int, kM - 2> kLow;
                    return lifted<kM - 2>(field, {graph(kLow, 2), graph(kLow, 1)});
                }
            throw ValueError("the newest field has too few dimensions to be lifted");
        },
        high.field);
    if (!a.flag("keep"))
        for (size_t k = 0; k <= count; ++k) s.fields.take();
    s.fields.push({made, fmt::format("{} of ({})", a.program(), high.program)}, s.now());
}

void height(Session& s, const Arguments& a) {
    mapField(s, a, [](const auto& field) -> AnyField {
        constexpr int kN = std::remove_cvref_t<decltype(field)>::kDimension + 1;
        if constexpr (kN <= 7) return heightField<kN>(field);
        throw ValueError("a field of 7 dimensions is not the height of anything");
    });
}

std::vector<Action> sources() {
    return {{.name = "ramp",
             .group = kGroup,
             .summary = "a linear ramp, direction·x + offset",
             .outputs = "field",
             .makes = {made("field", {Kind::field})},
             .options = {coordinates("direction", "0,1,0", "1 / world unit",
                                     "its gradient: as many numbers as the field has dimensions"),
                         real("offset", "0", "", "its value at the origin")},
             .examples = {"curlew -noise -ramp direction=0,0,1 -dfvn -velocity -write sheets.vdb"},
             .run =
                 [](Session& s, const Arguments& a) {
                     const auto make = [&](auto n) {
                         return rampField(a.coordinates<n>("direction"), a.real("offset"));
                     };
                     s.fields.push({inDimension(a.count("direction"), make), a.program()}, s.now());
                 }},
            {.name = "constant",
             .group = kGroup,
             .summary = "the same value everywhere",
             .outputs = "field",
             .makes = {made("field", {Kind::field})},
             .options = {real("value", "1", "", "the value"), integer("dim", "3", 1, 7, "dimensions of the field")},
             .examples = {"curlew -noise -constant value=0.5 -sum -probe in.csv out.csv"},
             .run = [](Session& s, const Arguments& a) {
                 const auto make = [&](auto n) { return constantField<n>(a.real("value")); };
                 s.fields.push({inDimension(static_cast<int>(a.integer("dim")), make), a.program()}, s.now());
             }}};
}

std::vector<Action> combinations() {
    return {combiningAction("sum", "the sum of two fields",
                            "curlew -noise -ramp direction=0,2,0 -sum -noise seed=1 -dfvn -velocity -write drift.vdb",
                            [](const auto& f, const auto& g, const Arguments&) { return f + g; }),
            combiningAction("subtract", "the newest field but one less the newest",
                            "curlew -noise dim=2 -noise dim=2 seed=1 -subtract -slice -write difference.png",
                            [](const auto& f, const auto& g, const Arguments&) { return f - g; }),
            combiningAction("product", "the product of two fields",
                            "curlew -noise -constant value=3 -product -probe in.csv out.csv",
                            [](const auto& f, const auto& g, const Arguments&) { return f * g; }),
            combiningAction("quotient", "the newest field but one over the newest, which must not be zero anywhere",
                            "curlew -noise -noise seed=1 -constant value=2 -sum -quotient -slice -write quotient.png",
                            [](const auto& f, const auto& g, const Arguments&) { return f / g; }),
            combiningAction(
                "min", "the smaller of two fields, rounded where they meet",
                "curlew -noise -noise seed=1 -min smoothing=0.2 -slice -write smaller.png",
                [](const auto& f, const auto& g, const Arguments& a) { return smoothMin(f, g, a.real("smoothing")); },
                {smoothing()}),
            combiningAction(
                "max", "the larger of two fields, rounded where they meet",
                "curlew -noise -noise seed=1 -max smoothing=0.2 -slice -write larger.png",
                [](const auto& f, const auto& g, const Arguments& a) { return smoothMax(f, g, a.real("smoothing")); },
                {smoothing()}),
            combiningAction(
                "displace", "the newest field but one, displaced by the gradient of the newest",
                "curlew -noise frequency=2 -noise frequency=1 seed=1 -displace amount=0.1 -slice -write displaced.png",
                [](const auto& f, const auto& g, const Arguments& a) { return displaced(f, g, a.real("amount")); },
                {real("amount", "0.1", "world units²", "factor on the gradient")})};
}

} // namespace

std::vector<Action> fieldActions() {
    std::vector<Action> actions = sources();
    for (auto& action : combinations()) actions.push_back(std::move(action));
    actions.push_back(
        {.name = "clip",
         .group = kGroup,
         .summary = "level the newest field off where it is beyond a range: a distance that only matters nearby",
         .inputs = "field",
         .outputs = "field",
         .takes = {taken("field", {Kind::field})},
         .makes = {made("field", {Kind::field})},
         .options = {positive("range", "0.5", "", "where it has levelled off, at half this value, C³"), keep()},
         .examples = {"curlew -sphere radius=0.5 -clip range=0.4 -slice -write clipped.png"},
         .run = [](Session& s, const Arguments& a) {
             mapField(s, a, [&](const auto& f) { return clipped(f, a.real("range")); });
         }});
    actions.push_back({.name = "height",
                       .group = kGroup,
                       .summary = "the newest field as a terrain: the last of one more coordinate, less the field",
                       .inputs = "field",
                       .outputs = "field of one dimension more",
                       .takes = {taken("field", {Kind::field})},
                       .makes = {made("field", {Kind::field})},
                       .options = {keep()},
                       .examples = {"curlew -noise dim=2 amplitude=0.3 -height -slice axis=y -write terrain.png"},
                       .run = height});
    actions.push_back(
        {.name = "lift",
         .group = kGroup,
         .summary = "evaluate the newest field on the graph of the field below it: anisotropy, slices, animation",
         .inputs = "field of n dimensions, above 1 or 2 functions of those that are left",
         .outputs = "field of 1 or 2 dimensions less",
         .takes = {several(taken("functions", {Kind::field}), 1, 2, "as many as functions= says"),
                   taken("field", {Kind::field})},
         .makes = {made("field", {Kind::field})},
         .options = {integer("functions", "1", 1, 2, "how many: the last coordinates are their values"), keep()},
         .examples =
             {"curlew -noise dim=2 frequency=3 amplitude=0.4 -noise type=simplex -lift -slice -write lifted.png",
              "curlew -constant value=0.3 -noise type=simplex dim=4 -lift -slice -write slice.png"},
         .run = lift});
    actions.push_back(
        {.name = "transform",
         .group = kGroup,
         .summary = "scale, turn and move the newest field",
         .inputs = "field",
         .outputs = "field",
         .takes = {taken("field", {Kind::field})},
         .makes = {made("field", {Kind::field, Kind::shape})},
         .options = {coordinates("offset", "0", "world units", "where its origin goes"),
                     vector("rotate", "0,0,0", "degrees", "turn about x, then y, then z; in 2D about z"),
                     coordinates("scale", "1", "", "size along each axis, first"), keep()},
         .examples =
             {"curlew -noise -transform scale=1,4,1 rotate=0,0,30 -slice box=-2,-2,-2,2,2,2 -write stretched.png"},
         .run = transform});
    return actions;
}

} // namespace curlew::app
