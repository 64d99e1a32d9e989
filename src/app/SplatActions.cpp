#include "CameraOptions.h"
#include "Options.h"
#include "curlew/app/Registry.h"
#include "curlew/app/Session.h"
#include "curlew/base/Random.h"
#include "curlew/picture/Display.h"
#include "curlew/picture/Exposure.h"
#include "curlew/render/Splat.h"
#include "curlew/render/WallOutline.h"

#include <algorithm>
#include <cmath>

namespace curlew::app {

namespace {

using namespace options;

enum class By { speed, height, depth, id, index, age };

/// The number that a position is coloured by, for points and for vertices of curves.
template <class Value>
std::vector<float> valuesOf(size_t count, const Value& value) {
    std::vector<float> values(count);
    for (size_t k = 0; k < count; ++k) values[k] = static_cast<float>(value(k));
    return values;
}

double part(size_t k, size_t count) {
    return count > 1 ? static_cast<double>(k) / static_cast<double>(count - 1) : 0.5;
}

double randomOf(int64_t id) { return randomUniform(0, static_cast<uint64_t>(id)); }

std::vector<float> ownValues(const Particles& p, By by) {
    switch (by) {
        case By::speed:
            if (!p.hasVelocity()) throw ValueError("these points have no velocity yet; -advect gives them one");
            return valuesOf(p.size(), [&](size_t k) { return length(Vec3f{{p.vx[k], p.vy[k], p.vz[k]}}); });
        case By::id:
            return valuesOf(p.size(), [&](size_t k) { return randomOf(p.id[k]); });
        case By::age:
            if (!p.hasAge()) throw ValueError("these points have no age; those of -emit have one");
            return p.age;
        default:
            return valuesOf(p.size(), [&](size_t k) { return part(k, p.size()); });
    }
}

std::vector<float> ownValues(const Curves& c, By by) {
    if (by == By::speed) return valuesOf(c.vertices(), [&](size_t v) { return c.speed(v); });
    if (by == By::age) return valuesOf(c.vertices(), [&](size_t v) { return c.along[v]; });
    std::vector<float> values;
    for (size_t k = 0; k < c.size(); ++k)
        values.insert(values.end(), c.start[k + 1] - c.start[k],
                      static_cast<float>(by == By::id ? randomOf(c.id[k]) : part(k, c.size())));
    return values;
}

/// What lies between two percentiles of the values, or a little around a constant.
Range rangeOf(std::vector<float> values) {
    const auto percentile = [&](double part) {
        const auto nth = values.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1));
        std::nth_element(values.begin(), nth, values.end());
        return static_cast<double>(*nth);
    };
    std::erase_if(values, [](float v) { return !std::isfinite(v); });
    if (values.empty()) return {0, 1};
    const double lower = percentile(0.02), upper = percentile(0.98);
    return lower < upper ? Range{lower, upper} : Range{lower - 0.5, lower + 0.5};
}

void color(Splats& splats, const Arguments& a, const Camera& camera, const Geometry& geometry) {
    if (a.given("color")) {
        if (a.given("by") || a.given("map")) throw ValueError("give color=, or by= and map=, not both");
        const Vec3d c = a.vector("color");
        for (int i = 0; i < 3; ++i) splats.color[i] = static_cast<float>(c[i]);
        return;
    }
    const auto* points = std::get_if<Particles>(&geometry);
    By by = static_cast<By>(a.choice("by"));
    if (!a.given("by") && points && !points->hasVelocity()) by = By::height;
    const auto along = [&](const Vec3d& axis) {
        return valuesOf(splats.x.size(), [&](size_t k) {
            return dot(axis, Vec3d{{splats.x[k], splats.y[k], splats.z[k]}} - camera.eye());
        });
    };
    if (by == By::height)
        splats.values = along(camera.up());
    else if (by == By::depth)
        splats.values = along(camera.forward());
    else if (points)
        splats.values = ownValues(*points, by);
    else
        splats.values = ownValues(*std::get<std::shared_ptr<const Curves>>(geometry), by);
    const Range range = a.given("range")                  ? a.interval("range")
                        : by == By::id || by == By::index ? Range{0, 1}
                                                          : rangeOf(splats.values);
    splats.scale = {.map = static_cast<ColorMap>(a.choice("map")),
                    .lower = static_cast<float>(range.lower),
                    .upper = static_cast<float>(range.upper)};
}

Splats splatsOf(const Geometry& geometry) {
    if (const auto* points = std::get_if<Particles>(&geometry)) return Splats::of(*points);
    if (const auto* curves = std::get_if<std::shared_ptr<const Curves>>(&geometry)) return Splats::of(**curves);
    throw ValueError("this is a mesh; -splat draws points and curves");
}

/// The age of the newest points or curves.
size_t newestDrawable(const Session& s) {
    for (size_t age = 0; age < s.geometry.size(); ++age)
        if (!std::holds_alternative<std::shared_ptr<const Mesh>>(s.geometry.at(age))) return age;
    throw ValueError("there are no points or curves to draw; make some with -scatter, -trace, …");
}

/// The domain whose wall is outlined: that of the newest flow; without one, the inside of the newest shape or level
/// set.
std::optional<Domain> outlined(Session& s, const Arguments& a) {
    if (a.real("outline") == 0 || a.flag("over")) return {};
    Domain domain;
    if (!s.flows.empty() && dimensionOf(s.flows.at()) == 3)
        domain = s.flow().domain();
    else if (s.flows.empty() && (s.newestField(true) || s.newestLevelSet()))
        domain = Domain::of({.sdf = s.newestSdf(0), .side = Side::inside});
    if (domain.wall && domain.box.finite()) return domain;
    return {};
}

/// What lies between the percentiles 0.5 and 99.5.
Range mostOf(std::vector<double> values) {
    const auto percentile = [&](double part) {
        const auto nth = values.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1));
        std::nth_element(values.begin(), nth, values.end());
        return *nth;
    };
    const double lower = percentile(0.005);
    return {lower, percentile(0.995)};
}

/// The nearest camera that sees nearly all of the splats: strays do not count.
Camera framing(const Arguments& a, const Splats& splats) {
    const Camera far = cameraOf(a, splats.bounds().padded(1e-6));
    const size_t every = splats.x.size() / 50000 + 1;
    std::vector<Vec3d> points;
    std::vector<double> across, upwards;
    for (size_t k = 0; k < splats.x.size(); k += every) {
        const Vec3d p{{splats.x[k], splats.y[k], splats.z[k]}};
        if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2])) continue;
        points.push_back(p);
        across.push_back(dot(p, far.right()));
        upwards.push_back(dot(p, far.up()));
    }
    if (points.size() < 2) return far;
    const Range x = mostOf(across), y = mostOf(upwards);
    std::erase_if(points, [&](const Vec3d& p) {
        const double right = dot(p, far.right()), up = dot(p, far.up());
        return !(right >= x.lower && right <= x.upper && up >= y.lower && up <= y.upper);
    });
    if (points.size() < 2) return far;
    return Camera::around(points, a.vector("from"), a.vector("up"), a.real("fov"), far.width(), far.height(), 0.07);
}

/// What is drawn on: the newest picture, or the background with the wall's outline.
ImageObject groundOf(Session& s, const Arguments& a, const Camera& camera, const std::optional<Domain>& domain) {
    if (a.flag("over")) return s.images.take();
    const Vec3d background = a.vector("background");
    Image ground = filledImage(camera.width(), camera.height(), {"R", "G", "B"});
    for (size_t k = 0; k < ground.pixels.size(); ++k)
        ground.pixels[k] = static_cast<float>(background[static_cast<int>(k % 3)]);
    if (!domain) return {.image = std::move(ground), .camera = camera};
    const Image outline = wallOutline(*domain, camera, s.console.follow("the wall's outline"));
    Image light = filledImage(camera.width(), camera.height(), {"R", "G", "B"});
    constexpr Vec3f kGlass{{0.45f, 0.62f, 0.85f}};
    for (size_t k = 0; k < light.pixels.size(); ++k)
        light.pixels[k] = outline.pixels[k / 3] * kGlass[static_cast<int>(k % 3)];
    return {.image = developed(light, a.real("outline"), std::move(ground)), .camera = camera};
}

/// The depth of what the picture shows so far, if it has one.
std::vector<float> depthOf(const Image& image) {
    const auto z = std::find(image.channels.begin(), image.channels.end(), "Z");
    if (z == image.channels.end()) return {};
    const size_t count = image.channels.size();
    std::vector<float> depth;
    for (auto k = static_cast<size_t>(z - image.channels.begin()); k < image.pixels.size(); k += count)
        depth.push_back(image.pixels[k]);
    return depth;
}

/// Puts an R, G, B, A, Z image over the ground, which then has these channels.
Image laidOver(const Image& top, const Image& ground, const std::vector<float>& depth) {
    Image picture = top;
    const size_t channels = ground.channels.size();
    const auto a = std::find(ground.channels.begin(), ground.channels.end(), "A");
    const auto places = rgbChannels(ground);
    for (size_t k = 0; k < picture.pixels.size() / 5; ++k) {
        float* const to = &picture.pixels[5 * k];
        const auto cover = static_cast<double>(to[3]);
        for (size_t i = 0; i < 3; ++i) {
            const double below = linearFromDisplay(static_cast<double>(ground.pixels[channels * k + (*places)[i]]));
            to[i] = static_cast<float>(
                displayFromLinear(below + cover * (linearFromDisplay(static_cast<double>(to[i])) - below)));
        }
        const float under = a == ground.channels.end()
                                ? 0
                                : ground.pixels[channels * k + static_cast<size_t>(a - ground.channels.begin())];
        to[3] = 1 - (1 - to[3]) * (1 - under);
        if (!depth.empty()) to[4] = std::min(to[4], depth[k]);
    }
    return picture;
}

void splatAction(Session& s, const Arguments& a) {
    const Geometry& geometry = s.geometry.at(a.given("geo") ? a.ages("geo").front() : newestDrawable(s));
    Splats splats = splatsOf(geometry);
    const bool over = a.flag("over");
    if (over && (!s.images.at().camera || !rgbChannels(s.images.at().image)))
        throw ValueError("over=1 wants a picture in perspective as the newest one, of -shade or -splat");
    const auto domain = outlined(s, a);
    const Camera camera = over ? *s.images.at().camera
                          : a.given("box") || a.given("eye")
                              ? cameraOf(a, a.given("box") ? a.box("box") : splats.bounds())
                              : framing(a, splats);
    color(splats, a, camera, geometry);
    const ImageObject ground = groundOf(s, a, camera, domain);
    const std::vector<float> depth = depthOf(ground.image);
    const SplatOptions options{
        .radius = a.given("radius") ? a.real("radius") : 0, .pixels = a.real("pixels"), .fade = a.real("fade")};
    const bool light = a.choice("look") == 0;
    const Monitor monitor = s.console.follow("splat");
    const SplatImage made = (light ? luminous : opaque)(splats, camera, options, depth, monitor);
    double exposure = 0;
    Image picture;
    if (light) {
        exposure = a.real("exposure") * automaticExposure(made.image);
        picture = developed(withGlow(made.image, a.real("glow")), exposure, ground.image);
    } else {
        picture = laidOver(made.image, ground.image, depth);
    }
    s.console.say(fmt::format("splat: {} of {} {} in {} x {} pixels, {:.1f} % of which they cover", made.drawn,
                              splats.x.size(), splats.start.empty() ? "points" : "vertices", camera.width(),
                              camera.height(), 100 * made.covered));
    s.report["splat"] = {{"drawn", made.drawn}, {"covered", made.covered}, {"exposure", exposure}};
    s.images.push({.image = std::move(picture), .camera = camera}, s.now());
}

std::vector<Option> splatOptions() {
    const auto upToOne = [](std::string name, std::string fallback, std::string help) {
        Option option = notNegative(std::move(name), std::move(fallback), "", std::move(help));
        option.upper = 1;
        return option;
    };
    std::vector<Option> all{
        choice("look", {"luminous", "opaque"}, "light that adds up, or balls and tubes that hide each other"),
        choice("by", {"speed", "height", "depth", "id", "index", "age"},
               "what the colour tells: speed, height or depth in the picture, a random number for each id, the order, "
               "or time since birth (of curves: the way from the seed); points without velocity have the height"),
        choice("map", {"viridis", "diverging", "gray", "ember", "ice"}, "the colours"),
        interval("range", "", "the values at both ends of the colours (default: percentiles 2 and 98)"),
        vector("color", "", "", "one colour instead, three display values from 0 to 1"),
        positive("radius", "", "world units", "of points and lines (default: as many pixels as pixels= says)"),
        positive("pixels", "1.5", "pixels", "their least radius; what is smaller gets fainter, not smaller"),
        upToOne("fade", "0.5", "how much weaker the farthest are than the nearest"),
        positive("exposure", "1", "", "luminous: brighter or darker than the automatic exposure by this factor"),
        upToOne("glow", "0.15", "luminous: part of the light that makes a halo"),
        notNegative("outline", "0.35", "",
                    "brightness of the edges of the flow's wall, or without a flow of the shape; 0: not seen"),
        vector("background", "0.012,0.016,0.03", "", "display values from 0 to 1"),
        flag("over", "0", "draw on the newest picture, with its camera, hidden behind what is nearer there"),
        ages("geo", "", "which points or curves (default: the newest)"),
        box("box", "what the camera has to see (default: nearly all that is drawn)")};
    for (auto& option : cameraOptions()) all.push_back(std::move(option));
    return all;
}

} // namespace

std::vector<Action> splatActions() {
    return {{.name = "splat",
             .group = "pictures",
             .summary = "a picture of the newest points or curves, as light or as balls and tubes, and of the wall "
                        "around them as a faint outline",
             .inputs = "points or curves; flow, shape or level set, if there is one (all stay)",
             .outputs = "image",
             .takes = {stays("what", {Kind::points, Kind::curves}, "geo"),
                       maybe(stays("wall", {Kind::flow, Kind::shape, Kind::levelSet}), "whose outline is shown"),
                       maybe(changed("image", {Kind::image}), "only with over=1: what is drawn on")},
             .makes = {made("image", {Kind::image})},
             .options = splatOptions(),
             .examples = {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn speed=1 -scatter "
                          "count=2000 -trace limit=3 -splat -write curves.png",
                          "curlew -torus -jitter count=3000 -splat look=opaque radius=0.02 map=ember -write balls.png",
                          "curlew -noise dim=2 -dfvn -scatter count=3000 -trace -splat from=0,0,1 fov=0.1 "
                          "-write flat.png"},
             .run = splatAction}};
}

} // namespace curlew::app
