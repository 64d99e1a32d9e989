#include "SurfaceColors.h"

#include "Options.h"
#include "curlew/app/Session.h"
#include "curlew/picture/Display.h"
#include "curlew/picture/Slice.h"
#include "curlew/render/SurfaceTexture.h"
#include "curlew/render/ThinFilm.h"

namespace curlew::app {

using namespace options;

namespace {

enum class Texture { none, checker, waves, latitude, terrain, film, lic };

/// What of the newest flow or field colours the surface.
SliceSource sourceOf(const Session& s, const std::string& shown) {
    if (shown != "value") return flowSource(s.flow(), shown);
    const auto age = s.newestField(false);
    if (!age) throw ValueError("there is no field to show on the surface; make one with -noise");
    return fieldSource(inSpace(s.fields.at(*age).field), shown);
}

/// The colours of values at these places, over the range that most of them have.
std::vector<Vec3f> colorsOf(const SliceSource& source, const std::vector<Vec3d>& positions, const Monitor& monitor) {
    std::vector<float> values(positions.size());
    parallelFor(
        values.size(), kBatch,
        [&](size_t begin, size_t end) {
            PointBatch points;
            for (size_t k = begin; k < end; ++k) points.push(positions[k]);
            SliceSource::Values batch(1);
            source.eval(points, batch);
            std::copy_n(batch[0].begin(), end - begin, values.begin() + static_cast<std::ptrdiff_t>(begin));
        },
        monitor);
    std::vector<Vec3f> colors;
    if (values.empty()) return colors;
    const bool positive = std::none_of(values.begin(), values.end(), [](float v) { return v < 0; });
    const ColorScale scale =
        automaticScale({.width = static_cast<int>(values.size()), .height = 1, .channels = {"value"}, .pixels = values},
                       positive ? ColorMap::viridis : ColorMap::diverging);
    colors.reserve(values.size());
    for (const float v : values) colors.push_back(colorAt(scale.map, (v - scale.lower) / (scale.upper - scale.lower)));
    return colors;
}

/// A colour for each place, by `colorAt(k)`.
template <class ColorAt>
std::vector<Vec3f> colorEach(size_t count, const Monitor& monitor, const ColorAt& colorOf) {
    std::vector<Vec3f> colors(count);
    parallelFor(
        count, 1024,
        [&](size_t begin, size_t end) {
            for (size_t k = begin; k < end; ++k) colors[k] = colorOf(k);
        },
        monitor);
    return colors;
}

/// What a film reflects that gets thicker from the top of the box to its bottom.
std::vector<Vec3f> filmColors(const SurfaceView& view, const std::vector<Vec3d>& positions, const Box& box,
                              const Range& thickness, const Monitor& monitor) {
    const ThinFilm film(std::max(thickness.lower, thickness.upper));
    return colorEach(positions.size(), monitor, [&](size_t k) {
        const double down = std::clamp((box.upper[1] - positions[k][1]) / box.size()[1], 0.0, 1.0);
        const SurfaceSample& hit = view.hits[k];
        const Vec3d toEye = view.camera.eye() - hit.position;
        Vec3d normal;
        for (int axis = 0; axis < 3; ++axis) normal[axis] = static_cast<double>(hit.normal[axis]);
        const Vec3d light = film.reflectance(thickness.lower + down * (thickness.upper - thickness.lower),
                                             dot(normal, toEye) / length(toEye));
        Vec3f color;
        for (int c = 0; c < 3; ++c) color[c] = static_cast<float>(displayFromLinear(std::max(light[c], 0.0)));
        return color;
    });
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
        choice("texture", {"none", "checker", "waves", "latitude", "terrain", "film", "lic"},
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
    const Vec3f color = colorOption(a, "color"), second = colorOption(a, "second");
    const Range thickness = a.interval("film");
    if (!(thickness.lower >= 0) || !(thickness.upper >= 0)) throw ValueError("film has a negative thickness");
    return [=, &s](const SurfaceView& view, const Monitor& monitor) {
        std::vector<Vec3d> places = positionsOf(view);
        if (a.real("time") != 0 && !places.empty()) {
            const AdvectResult carried = advect(*flow, places, carryOptions(a), monitor);
            s.report["shade_carried"] = {{"not_converged", carried.notConverged},
                                         {"retries", carried.retries},
                                         {"iterations_mean", carried.meanIterations}};
        }
        const double edge = a.real("edge");
        switch (texture) {
            case Texture::checker:
                return colorEach(places.size(), monitor,
                                 [&](size_t k) { return checkerAt(places[k], edge, color, second); });
            case Texture::waves:
                return colorEach(places.size(), monitor, [&](size_t k) { return wavesAt(places[k], edge); });
            case Texture::latitude:
                return colorEach(places.size(), monitor, [&](size_t k) { return latitudeAt(places[k], box.center()); });
            case Texture::terrain:
                return colorEach(places.size(), monitor,
                                 [&](size_t k) { return terrainAt((places[k][1] - box.lower[1]) / box.size()[1]); });
            case Texture::film:
                return filmColors(view, places, box, thickness, monitor);
            case Texture::none:
            case Texture::lic:
                break;
        }
        std::vector<Vec3f> colors = source && !places.empty() ? colorsOf(*source, places, monitor) : std::vector{color};
        if (texture == Texture::none) return colors;
        const std::vector<float> streaks =
            surfaceLic(view, *flow, {.seed = static_cast<uint64_t>(a.integer("seed"))}, monitor);
        return colorEach(streaks.size(), monitor, [&](size_t k) {
            return (colors.size() == 1 ? color : colors[k]) * (0.3f + 0.9f * streaks[k]);
        });
    };
}

} // namespace curlew::app
