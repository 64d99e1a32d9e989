// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "Kink.h"
#include "curlew/app/registry/Text.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/ParsedFormula.h"
#include "curlew/field/Transforms.h"

#include <algorithm>

namespace curlew::app {

namespace {

using namespace options;

const std::string kFieldGroup = "fields";

/// Calls `make` with `dim` as a std::integral_constant.
template <int N = 1, class Make>
AnyField inDimension(int dim, const Make& make) {
    if constexpr (N < 7)
        if (dim != N) return inDimension<N + 1>(dim, make);
    return make(std::integral_constant<int, N>());
}

/// Declares an action that combines two fields of any dimension.
template <class Combine>
Action combiningAction(const std::string& name, const std::string& summary, const std::string& example, Combine combine,
                       std::vector<Option> options = {}) {
    options.push_back(keep());
    return {.name = name,
            .group = kFieldGroup,
            .summary = summary,
            .takes = {taken("first", {Kind::field}), taken("second", {Kind::field})},
            .makes = {made("field", {Kind::field})},
            .options = std::move(options),
            .examples = {example},
            .evaluation = Evaluation::anyTime,
            .run = [combine](Context& c, const Arguments& a) {
                if (a.action().option("smoothing")) sayKink(c, a);
                c.give(FieldValue{combined(c.field("first").field, c.field("second").field,
                                           [&](const auto& f, const auto& g) { return combine(f, g, a); })});
            }};
}

Option smoothing() {
    return notNegative("smoothing", "0.1", "",
                       "difference of the two values below which the kink is rounded off (C²); 0: a kink, at which the "
                       "velocity of a flow jumps");
}

/// Returns map(field).
template <class Map>
AnyField mapped(const Context& c, const Map& map) {
    return std::visit([&](const auto& f) -> AnyField { return map(f); }, c.field("field").field);
}

/// Returns whether the scale is uniform and positive. A distance, scaled in this way, remains a distance.
bool similar(const Arguments& a) {
    const auto alike = [](const auto& scale) {
        return scale[0] > 0 && std::all_of(scale.c.begin(), scale.c.end(), [&](double s) { return s == scale[0]; });
    };
    const int count = a.count("scale");
    if (count == 2) return alike(a.coordinates<2>("scale"));
    return (count == 1 || count == 3) && alike(a.coordinates<3>("scale"));
}

template <int N>
PlacementN<N> transformOf(const Arguments& a) {
    return {.offset = a.coordinates<N>("translate"), .rotate = a.vector("rotate"), .scale = a.coordinates<N>("scale")};
}

void transform(Context& c, const Arguments& a) {
    FieldValue moved{mapped(c, [&](const auto& field) {
        return placed(field, transformOf<std::remove_cvref_t<decltype(field)>::kDimension>(a));
    })};
    if (const auto& shape = c.field("field").sdf; shape && similar(a))
        std::visit(
            [&](const auto& sdf) {
                const auto put = placed(sdf, transformOf<std::remove_cvref_t<decltype(sdf.distance)>::kDimension>(a));
                moved = {put.distance, put};
            },
            *shape);
    if (const auto& region = c.field("field").sampled) {
        moved.sampled = region;
        const auto placement = transformOf<3>(a);
        moved.sampled->box = placed(region->box, placement);
        moved.sampled->voxel *=
            std::max({std::abs(placement.scale[0]), std::abs(placement.scale[1]), std::abs(placement.scale[2])});
    }
    c.give(std::move(moved));
}

/// Restricts a field to the graph of one or two functions of the remaining coordinates.
void lift(Context& c, const Arguments&) {
    const AnyField& high = c.field("field").field;
    const size_t count = c.count("graph");
    const int wanted = dimensionOf(high) - static_cast<int>(count);
    for (size_t k = 0; k < count; ++k)
        if (const int n = dimensionOf(c.field("graph", k).field); n != wanted)
            throw ValueError(
                fmt::format("the field has {} dimensions, so each function of the graph needs {}, but one has {}",
                            dimensionOf(high), wanted, n));
    c.give(FieldValue{std::visit(
        [&](const auto& field) -> AnyField {
            constexpr int kM = std::remove_cvref_t<decltype(field)>::kDimension;
            const auto graph = [&](auto dimension, size_t k) {
                return std::get<ScalarFieldN<decltype(dimension)::value>>(c.field("graph", k).field);
            };
            if constexpr (kM >= 2)
                if (count == 1) return lifted<kM - 1>(field, {graph(std::integral_constant<int, kM - 1>(), 0)});
            if constexpr (kM >= 3)
                if (count == 2) {
                    constexpr std::integral_constant<int, kM - 2> kLow;
                    return lifted<kM - 2>(field, {graph(kLow, 0), graph(kLow, 1)});
                }
            throw ValueError("the field has too few dimensions for -lift");
        },
        high)});
}

void height(Context& c, const Arguments&) {
    c.give(FieldValue{mapped(c, [](const auto& field) -> AnyField {
        constexpr int kN = std::remove_cvref_t<decltype(field)>::kDimension + 1;
        if constexpr (kN <= 7) return heightField<kN>(field);
        throw ValueError("the field must have at most 6 dimensions, since -height adds one; it has 7");
    })});
}

using Objects = std::vector<std::vector<Object>>;

/// Returns one field of this dimension.
std::vector<Object> fieldOf(int dimension, Kind kind = Kind::noise) {
    return {{.kind = kind, .dimension = dimension, .name = "field"}};
}

int dimensionOfInput(const Objects& inputs, size_t input) {
    return inputs.at(input).empty() ? 3 : inputs[input].front().dimension;
}

Input graphInput() {
    Input input = several(taken("graph", {Kind::field}), 1, 2, "functions= fields");
    input.amountWith = [](const Arguments& a, const Scope& scope) {
        const auto count = a.integer<size_t>("functions");
        return scope.linked() ? Amount{1, 2} : Amount{count, count};
    };
    return input;
}

/// Returns the dimension of a formula: 3 without fields, otherwise that of its fields, or more if a coordinate needs
/// it. In 3D, fields of fewer dimensions are constant along the other axes.
int dimensionOfFormula(const Arguments& a, const std::vector<int>& fields) {
    const int least = fields.empty() ? 3 : *std::max_element(fields.begin(), fields.end());
    const int dimension =
        a.given("dimensions") ? a.integer<int>("dimensions") : std::max(least, lastCoordinateIn(a.words().front()));
    for (const int n : fields)
        if (n > dimension || (n < dimension && dimension != 3))
            throw ValueError(fmt::format("a field of {} dimensions in a formula of {} dimensions", n, dimension));
    return dimension;
}

template <int N>
ScalarFieldN<N> inFormula(const AnyField& field) {
    if constexpr (N == 3) return inSpace(field);
    return std::get<ScalarFieldN<N>>(field);
}

void formula(Context& c, const Arguments& a) {
    const std::string& text = a.words().front();
    const std::vector<std::string> names = namesInFormula(text);
    std::vector<int> dimensions;
    for (size_t k = 0; k < c.count("fields"); ++k) dimensions.push_back(dimensionOf(c.field("fields", k).field));
    c.give(FieldValue{inDimension(dimensionOfFormula(a, dimensions), [&](auto n) {
        NamedFields<n> fields;
        for (size_t k = 0; k < names.size(); ++k) fields.emplace(names[k], inFormula<n>(c.field("fields", k).field));
        auto made = parsedFormula<n>(text, fields);
        if (!made.kinks.empty())
            c.info(
                fmt::format("formula: {} may have a kink, at which the velocity of a flow jumps; smin, smax and "
                            "smoothstep have none",
                            join(made.kinks, ", ")));
        return made.field;
    })});
}

/// Checks the fields that are linked, and returns what the formula makes.
std::vector<Object> madeByFormula(const Arguments& a, const Objects& inputs, const World&) {
    const std::vector<std::string> names = namesInFormula(a.words().front());
    if (names.size() != inputs.at(0).size())
        throw ValueError(fmt::format("the formula names {} fields{}, but {} are linked", names.size(),
                                     names.empty() ? "" : " (" + join(names, ", ") + ")", inputs[0].size()));
    std::vector<int> dimensions;
    for (const Object& field : inputs[0]) dimensions.push_back(field.dimension);
    return fieldOf(dimensionOfFormula(a, dimensions));
}

Action formulaAction() {
    Input fields = several(stays("fields", {Kind::field}), 0, 100, "those that the formula names, in that order");
    fields.namesWith = [](const Arguments& a) { return namesInFormula(a.words().front()); };
    return {.name = "formula",
            .group = kFieldGroup,
            .summary = "field from a formula of the position and of other fields, with exact derivatives",
            .takes = {std::move(fields)},
            .makes = {made("field", {Kind::field})},
            .options = {integer("dimensions", "", 1, 7,
                                "number of dimensions (default: that of its fields, or 3; more if a coordinate needs "
                                "it)")},
            .positional = {.what = "FORMULA", .minimum = 1, .maximum = 1, .formulas = true},
            .examples = {"curlew -formula '(x^2 + y^2 + z^2)^2' -formula 'x + 0.2*sin(4*z)' -dfvn -velocity -write "
                         "rings.vdb",
                         "curlew -noise as=swirl -formula '0.3*swirl + smoothstep(-1, 1, y)' -noise seed=1 -dfvn "
                         "-velocity -write layers.vdb"},
            .evaluation = Evaluation::anyTime,
            .run = formula,
            .makesWith = madeByFormula};
}

Registry sources() {
    return {
        formulaAction(),
        {.name = "ramp",
         .group = kFieldGroup,
         .summary = "linear ramp, gradient·x + value",
         .makes = {made("field", {Kind::field})},
         .options = {formerly({"direction"},
                              coordinates("gradient", "0,1,0", "1 / world unit",
                                          "gradient of the ramp: one number for each dimension of the field")),
                     formerly({"offset"}, real("value", "0", "", "value at the origin"))},
         .examples = {"curlew -noise -ramp gradient=0,0,1 -dfvn -velocity -write sheets.vdb"},
         .evaluation = Evaluation::anyTime,
         .run =
             [](Context& c, const Arguments& a) {
                 c.give(FieldValue{inDimension(a.count("gradient"), [&](auto n) {
                     return rampField(a.coordinates<n>("gradient"), a.real("value"));
                 })});
             },
         .makesWith = [](const Arguments& a, const Objects&, const World&) { return fieldOf(a.count("gradient")); }},
        {.name = "constant",
         .group = kFieldGroup,
         .summary = "constant field: the same value everywhere",
         .makes = {made("field", {Kind::field})},
         .options = {real("value", "1", "", "value of the field"),
                     formerly({"dim"}, integer("dimensions", "3", 1, 7, "number of dimensions of the field"))},
         .examples = {"curlew -noise -constant value=0.5 -sum -probe in.csv out.csv"},
         .evaluation = Evaluation::anyTime,
         .run =
             [](Context& c, const Arguments& a) {
                 c.give(FieldValue{inDimension(a.integer<int>("dimensions"),
                                               [&](auto n) { return constantField<n>(a.real("value")); })});
             },
         .makesWith = [](const Arguments& a, const Objects&,
                         const World&) { return fieldOf(a.integer<int>("dimensions")); }}};
}

Registry combinations() {
    return {
        combiningAction("sum", "A + B, the sum of the newest two fields",
                        "curlew -noise -ramp gradient=0,2,0 -sum -noise seed=1 -dfvn -velocity -write drift.vdb",
                        [](const auto& f, const auto& g, const Arguments&) { return f + g; }),
        combiningAction("subtract", "A - B, where B is the newest field and A the one before it",
                        "curlew -noise dimensions=2 -noise dimensions=2 seed=1 -subtract -slice -write difference.png",
                        [](const auto& f, const auto& g, const Arguments&) { return f - g; }),
        combiningAction("product", "A * B, the product of the newest two fields",
                        "curlew -noise -constant value=3 -product -probe in.csv out.csv",
                        [](const auto& f, const auto& g, const Arguments&) { return f * g; }),
        combiningAction("quotient",
                        "A / B, where B is the newest field and A the one before it; B must not be zero anywhere",
                        "curlew -noise -noise seed=1 -constant value=2 -sum -quotient -slice -write quotient.png",
                        [](const auto& f, const auto& g, const Arguments&) { return f / g; }),
        combiningAction(
            "min", "smooth minimum of the newest two fields",
            "curlew -noise -noise seed=1 -min smoothing=0.2 -slice -write smaller.png",
            [](const auto& f, const auto& g, const Arguments& a) { return smoothMin(f, g, a.real("smoothing")); },
            {smoothing()}),
        combiningAction(
            "max", "smooth maximum of the newest two fields",
            "curlew -noise -noise seed=1 -max smoothing=0.2 -slice -write larger.png",
            [](const auto& f, const auto& g, const Arguments& a) { return smoothMax(f, g, a.real("smoothing")); },
            {smoothing()}),
        combiningAction(
            "displace",
            "domain warp: A displaced by the gradient of B, where B is the newest field and A the one before it",
            "curlew -noise frequency=2 -noise frequency=1 seed=1 -displace amount=0.1 -slice -write displaced.png",
            [](const auto& f, const auto& g, const Arguments& a) { return displaced(f, g, a.real("amount")); },
            {real("amount", "0.1", "world units²", "factor by which the gradient of B is multiplied")})};
}

} // namespace

Registry fieldActions() {
    Registry actions = sources();
    for (auto& action : combinations()) actions.push_back(std::move(action));
    actions.push_back(
        {.name = "clip",
         .group = kFieldGroup,
         .summary = "clamp the newest field smoothly to a range; a distance then matters only near its surface",
         .takes = {taken("field", {Kind::field})},
         .makes = {made("field", {Kind::field})},
         .options = {formerly({"range"},
                              positive("limit", "0.5", "",
                                       "absolute value from which the result is constant, at half this value (C³)")),
                     keep()},
         .examples = {"curlew -sphere radius=0.5 -clip limit=0.4 -slice -write clipped.png"},
         .evaluation = Evaluation::anyTime,
         .run = [](Context& c, const Arguments& a) {
             c.give(FieldValue{mapped(c, [&](const auto& f) { return clipped(f, a.real("limit")); })});
         }});
    actions.push_back(
        {.name = "height",
         .group = kFieldGroup,
         .summary = "height field (terrain): a new last coordinate minus the newest field",
         .takes = {taken("field", {Kind::field})},
         .makes = {made("field", {Kind::field})},
         .options = {keep()},
         .examples = {"curlew -noise dimensions=2 amplitude=0.3 -height -slice axis=y -write terrain.png"},
         .evaluation = Evaluation::anyTime,
         .run = height,
         .makesWith = [](const Arguments&, const Objects& inputs, const World&) {
             return fieldOf(dimensionOfInput(inputs, 0) + 1);
         }});
    actions.push_back(
        {.name = "lift",
         .group = kFieldGroup,
         .summary = "restrict the newest field to the graph of the field before it: anisotropy, slices, animation",
         .takes = {graphInput(), taken("field", {Kind::field})},
         .makes = {made("field", {Kind::field})},
         .options = {selector(
                         integer("functions", "1", 1, 2, "number of functions, whose values are the last coordinates")),
                     keep()},
         .examples =
             {"curlew -noise dimensions=2 frequency=3 amplitude=0.4 -noise type=simplex -lift -slice -write lifted.png",
              "curlew -constant value=0.3 -noise type=simplex dimensions=4 -lift -slice -write slice.png"},
         .evaluation = Evaluation::anyTime,
         .run = lift,
         .makesWith = [](const Arguments&, const Objects& inputs, const World&) {
             return fieldOf(std::max(1, dimensionOfInput(inputs, 1) - static_cast<int>(inputs[0].size())));
         }});
    actions.push_back(
        {.name = "transform",
         .group = kFieldGroup,
         .summary = "scale, rotate and translate the newest field",
         .takes = {taken("field", {Kind::field})},
         .makes = {made("field", {Kind::field, Kind::shape})},
         .options = {formerly({"offset"}, coordinates("translate", "0", "world units", "translation")),
                     vector("rotate", "0,0,0", "degrees", "rotation about x, then y, then z; in 2D about z"),
                     coordinates("scale", "1", "",
                                 "scale along each axis, applied before the rotation and the translation"),
                     keep()},
         .examples =
             {"curlew -noise -transform scale=1,4,1 rotate=0,0,30 -slice box=-2,-2,-2,2,2,2 -write stretched.png"},
         .evaluation = Evaluation::anyTime,
         .run = transform,
         .makesWith = [](const Arguments& a, const Objects& inputs, const World&) {
             const bool shape = !inputs[0].empty() && inputs[0].front().kind == Kind::shape && similar(a);
             return fieldOf(dimensionOfInput(inputs, 0), shape ? Kind::shape : Kind::noise);
         }});
    return actions;
}

} // namespace curlew::app
