#include "SurfaceColors.h"

#include "Options.h"
#include "curlew/app/Session.h"
#include "curlew/render/SurfacePaint.h"

namespace curlew::app {

using namespace options;

namespace {

/// What of the newest flow or field colours the surface.
SliceSource sourceOf(const Session& s, const std::string& shown) {
    if (shown != "value") return flowSource(s.flow(), shown);
    const auto age = s.newestField(false);
    if (!age) throw ValueError("there is no field to show on the surface; make one with -noise");
    return fieldSource(inSpace(s.fields.at(*age).field), shown);
}

AdvectOptions carryOptions(const Arguments& a) {
    return {.time = -a.real("time"),
            .steps = static_cast<int>(a.integer("steps")),
            .scheme = static_cast<Scheme>(a.choice("scheme")),
            .reprojection = static_cast<Reprojection>(a.choice("reproject"))};
}

} // namespace

Vec3f colorOption(const Arguments& a, std::string_view name) {
    const Vec3d given = a.vector(name);
    Vec3f color;
    for (int i = 0; i < 3; ++i) {
        if (!(given[i] >= 0)) throw ValueError(fmt::format("{} has a negative part", name));
        color[i] = static_cast<float>(given[i]);
    }
    return color;
}

bool paintsFilm(const Arguments& a) { return static_cast<Texture>(a.choice("texture")) == Texture::film; }

std::vector<Option> colorOptions() {
    return {
        vector("color", "0.74,0.70,0.65", "", "of the surface: sRGB from 0 to 1"),
        choice("show", {"color", "value", "speed", "vx", "vy", "vz", "f", "g"},
               "what colours it: color=, or what the newest field or flow has there"),
        choice("texture", namesOf(kTextureNames),
               "on it: cubes of two colours; waves around the y axis (ICN Fig. 5); the bands of a planet; those of a "
               "landscape, by height in its box; the interference colours of a thin film (the surface is then "
               "clear); streaks along the newest flow"),
        positive("edge", "0.1", "world units", "of the cubes, or the width of the waves"),
        vector("second", "0.16,0.20,0.26", "", "the other colour of the cubes"),
        {.name = "film",
         .type = OptionType::interval,
         .fallback = "80,900",
         .help = "thickness of the film at its top and bottom",
         .unit = "nm"},
        integer("seed", "0", 0, 0x1p53 - 1, "of the streaks"),
        real("time", "0", "s", "for how long the newest flow has carried the texture, or what show= shows, along"),
        integer("steps", "64", 1, 1e9, "steps of equal length on that way"),
        choice("scheme", {"euler", "midpoint", "rk4"}, "integrator", "rk4"),
        choice("reproject", {"none", "newton", "gauss-newton"}, "how it keeps to the surface", "gauss-newton")};
}

Painter painterOf(Session& s, const Arguments& a, const Box& box) {
    const auto texture = static_cast<Texture>(a.choice("texture"));
    std::optional<SliceSource> source;
    if (a.choice("show") > 0) source = sourceOf(s, a.text("show"));
    if (source && texture != Texture::none && texture != Texture::lic)
        throw ValueError(fmt::format("show={} and texture={} do not go together", a.text("show"), a.text("texture")));
    std::optional<Flow> flow;
    if (a.real("time") != 0 || texture == Texture::lic) flow = s.flow();
    const Range thickness = a.interval("film");
    if (!(thickness.lower >= 0) || !(thickness.upper >= 0)) throw ValueError("film has a negative thickness");
    const SurfacePaint paint{.texture = texture,
                             .color = colorOption(a, "color"),
                             .second = colorOption(a, "second"),
                             .edge = a.real("edge"),
                             .film = thickness,
                             .box = box,
                             .seed = static_cast<uint64_t>(a.integer("seed")),
                             .source = std::move(source),
                             .flow = std::move(flow),
                             .carry = carryOptions(a)};
    return [paint, &s](const SurfaceView& view, const Monitor& monitor) {
        PaintedColors painted = paintedColors(view, paint, monitor);
        if (const auto& carried = painted.carried)
            s.report["shade_carried"] = {{"not_converged", carried->notConverged},
                                         {"retries", carried->retries},
                                         {"iterations_mean", carried->meanIterations}};
        return std::move(painted.colors);
    };
}

} // namespace curlew::app
