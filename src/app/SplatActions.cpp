#include "CameraOptions.h"
#include "Options.h"
#include "curlew/app/Registry.h"
#include "curlew/app/Session.h"
#include "curlew/picture/Composite.h"
#include "curlew/picture/Display.h"
#include "curlew/picture/Exposure.h"
#include "curlew/render/Splat.h"
#include "curlew/render/SplatValues.h"
#include "curlew/render/WallOutline.h"

namespace curlew::app {

namespace {

using namespace options;

void color(Splats& splats, const Arguments& a, const Camera& camera, const Geometry& geometry) {
    if (a.given("color")) {
        if (a.given("by") || a.given("map")) throw ValueError("give color=, or by= and map=, not both");
        const Vec3d c = a.vector("color");
        for (int i = 0; i < 3; ++i) splats.color[i] = static_cast<float>(c[i]);
        return;
    }
    const auto* points = std::get_if<Particles>(&geometry);
    auto by = static_cast<SplatValue>(a.choice("by"));
    if (!a.given("by") && points && !points->hasVelocity()) by = SplatValue::height;
    splats.values = points ? splatValues(*points, by, camera)
                           : splatValues(*std::get<std::shared_ptr<const Curves>>(geometry), by, camera);
    const Range range = a.given("range") ? a.interval("range") : splatRange(splats.values, by);
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

/// What is drawn on: the newest picture, or the background with the wall's outline.
Image groundOf(Session& s, const Arguments& a, const Camera& camera, const std::optional<Domain>& domain) {
    if (a.flag("over")) return s.images.take().image;
    Vec3f background;
    for (int i = 0; i < 3; ++i) background[i] = static_cast<float>(a.vector("background")[i]);
    Image ground = plainPicture(camera.width(), camera.height(), background);
    if (!domain) return ground;
    return withWallOutline(std::move(ground), *domain, camera, a.real("outline"),
                           s.console.follow("the wall's outline"));
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
                              : framing(splats, viewpointOf(a));
    color(splats, a, camera, geometry);
    const Image ground = groundOf(s, a, camera, domain);
    const std::vector<float> depth = depthOf(ground);
    const SplatOptions options{
        .radius = a.given("radius") ? a.real("radius") : 0, .pixels = a.real("pixels"), .fade = a.real("fade")};
    const bool light = a.choice("look") == 0;
    const Monitor monitor = s.console.follow("splat");
    const SplatImage made = (light ? luminous : opaque)(splats, camera, options, depth, monitor);
    double exposure = 0;
    Image picture;
    if (light) {
        exposure = a.real("exposure") * automaticExposure(made.image);
        picture = developed(withGlow(made.image, a.real("glow")), exposure, ground);
    } else {
        picture = composite(made.image, ground);
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
        choice("by", namesOf(kSplatValueNames),
               "what the colour tells: speed, height or depth in the picture, a random number for each id, the order, "
               "or time since birth (of curves: the way from the seed); points without velocity have the height"),
        choice("map", namesOf(kColorMapNames), "the colours"),
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
