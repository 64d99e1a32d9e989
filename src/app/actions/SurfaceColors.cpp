// SPDX-License-Identifier: Apache-2.0
#include "SurfaceColors.h"

#include "Actions.h"
#include "TrackOptions.h"

namespace curlew::app {

using namespace options;

namespace {

Texture textureOf(const Arguments& a) { return a.choice<Texture>("texture"); }

constexpr double kEdge = 0.03; ///< Edge of a checker, relative to the diagonal.

bool showsValue(const Arguments& a) { return a.text("show") == "value"; }
bool showsFlow(const Arguments& a) { return a.text("show") != "color" && !showsValue(a); }

/// The options for the steps along the flow that carries a texture.
const Binding<AdvectOptions>& textureStepBinding() {
    static const auto binding = stepBinding<AdvectOptions>(
        "number of equal steps along the flow, instead of steps chosen by accuracy=; with both, accuracy= chooses them "
        "(default: 64 for schemes without error estimate)",
        "maximum estimated error of a step along the flow (default: 1e-6 of the diagonal of the flow's box, unless "
        "steps= or a scheme without error estimate is given)");
    return binding;
}

AdvectOptions carryOptions(const Arguments& a) {
    constexpr int kEqualSteps = 64; // for a scheme without error estimate
    AdvectOptions options = textureStepBinding().read(a);
    if (asksForEqualSteps(a, options.scheme)) options.steps = kEqualSteps;
    options.time = -a.real("duration"); // backward, to the origin of the colours
    options.reprojection.method = a.choice<Reprojection>("reproject");
    return options;
}

} // namespace

bool everNonzero(const Arguments& a, std::string_view name) {
    const auto written = a.written().find(name);
    return (written != a.written().end() && variablesOf(written->second).any) || a.real(name) != 0;
}

Vec3f colorOption(const Arguments& a, std::string_view name) {
    const Vec3d given = a.vector(name);
    Vec3f color;
    for (int i = 0; i < 3; ++i) {
        if (!(given[i] >= 0 && given[i] <= 1))
            throw ValueError(fmt::format("{}: {} is not between 0 and 1; colours are sRGB", name, given[i]));
        color[i] = static_cast<float>(given[i]);
    }
    return color;
}

std::vector<Option> colorOptions() {
    const SurfacePaint paint;
    const AdvectOptions& carry = paint.carry;
    std::vector<Option> all{
        vector("color", fmt::format("{:.2f}", fmt::join(paint.color.c, ",")), "",
               "colour of the surface: sRGB from 0 to 1"),
        choice("show", {"color", "value", "speed", "vx", "vy", "vz", "f", "g"},
               "source of the colour: color=, or the newest field or flow at the surface"),
        choice("texture", kTextureNames,
               "pattern on the surface: cubes of two colours; waves around the y axis (ICN Fig. 5); the bands of a "
               "planet; those of a landscape, by height in its box; the interference colours of a thin film (the "
               "surface is then clear); streaks along the newest flow"),
        positive("edge", "", "world units",
                 "edge length of the cubes, or width of the waves (default: 3 % of the diagonal of the surface's box)"),
        vector("second", fmt::format("{:.2f}", fmt::join(paint.second.c, ",")), "", "second colour of the cubes"),
        {.name = "film",
         .type = OptionType::interval,
         .fallback = fmt::format("{},{}", paint.film.lower, paint.film.upper),
         .help = "thickness of the film at its top and bottom",
         .unit = "nm"},
        integer("seed", fmt::format("{}", paint.seed), 0, 0x1p53 - 1, "random seed of the streaks"),
        formerly({"time"}, real("duration", fmt::format("{}", carry.time), "s",
                                "time for which the newest flow has advected the texture, or what show= shows"))};
    all.insert(all.end(), textureStepBinding().options().begin(), textureStepBinding().options().end());
    all.push_back(choice("reproject", namesOf(kReprojectionNames),
                         "method that keeps the advected texture on the surface",
                         std::string(kReprojectionNames[static_cast<size_t>(carry.reprojection.method)])));
    return all;
}

std::vector<Input> colorInputs() {
    return {onlyIf(stays("value", {Kind::noise}), "only with show=value", showsValue),
            onlyIf(stays("flow", {Kind::flow}), "only with duration=, texture=lic, or show= of a flow",
                   [](const Arguments& a) {
                       return showsFlow(a) || everNonzero(a, "duration") || textureOf(a) == Texture::lic;
                   })};
}

SurfacePaint paintOf(const Context& c, const Arguments& a, const Box& box) {
    SurfacePaint paint{.texture = textureOf(a),
                       .color = colorOption(a, "color"),
                       .second = colorOption(a, "second"),
                       .edge = a.given("edge") ? a.real("edge") : kEdge * length(box.size()),
                       .film = a.interval("film"),
                       .box = box,
                       .seed = a.integer<uint64_t>("seed"),
                       .carry = carryOptions(a)};
    if (!(paint.film.lower >= 0) || !(paint.film.upper >= 0)) throw ValueError("film has a negative thickness");
    if (c.has("flow")) paint.flow = c.flow("flow");
    if (showsValue(a)) paint.source = fieldSource(inSpace(c.field("value").field), "value");
    if (showsFlow(a)) paint.source = flowSource(*paint.flow, a.text("show"));
    if (paint.source && paint.texture != Texture::none && paint.texture != Texture::lic)
        throw ValueError(fmt::format("show={} and texture={} cannot be combined", a.text("show"), a.text("texture")));
    return paint;
}

} // namespace curlew::app
