// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "CameraOptions.h"
#include "SurfaceColors.h"
#include "curlew/base/Memory.h"
#include "curlew/picture/Composite.h"
#include "curlew/picture/Display.h"
#include "curlew/picture/Exposure.h"
#include "curlew/render/Splat.h"
#include "curlew/render/SplatValues.h"
#include "curlew/render/WallOutline.h"
#include "curlew/render/WallPicture.h"

namespace curlew::app {

namespace {

using namespace options;

/// Returns the points; null if curves are drawn.
const Points* pointsOf(const Context& c) {
    return c.kind("what") == Kind::points ? &c.points("what").particles : nullptr;
}

/// What a picture keeps from frame to frame.
struct Kept {
    std::optional<Camera> camera;  ///< That of all frames.
    std::optional<Interval> range; ///< Of the colours in the frame before.
    bool warned = false;           ///< That the range jumps.
};

Kept& keptFromFrames(const Context& c) {
    auto& object = c.memory().object;
    if (!object) object = std::make_shared<Kept>();
    return *std::static_pointer_cast<Kept>(object);
}

/// Warns, once, if the colours of a frame stand for other values than those of the frame before.
void warnOfRange(const Context& c, const Interval& now, size_t values) {
    constexpr double kJump = 0.2;
    constexpr size_t kFew = 100; // the range of few values is mostly chance
    if (!c.clock() || values < kFew) return;
    Kept& kept = keptFromFrames(c);
    const auto before = std::exchange(kept.range, now);
    if (!before || kept.warned) return;
    const double jump = std::max(std::abs(now.lower - before->lower), std::abs(now.upper - before->upper)),
                 least = std::min(now.lower, before->lower), most = std::max(now.upper, before->upper);
    if (!(jump > kJump * (most - least))) return;
    kept.warned = true;
    c.warn(
        fmt::format("the colours stand for {:.3g} to {:.3g} in this frame, and for {:.3g} to {:.3g} in the one "
                    "before, so films flicker; range= keeps them the same",
                    now.lower, now.upper, before->lower, before->upper));
}

void color(Splats& splats, const Context& c, const Arguments& a, const Camera& camera) {
    if (a.given("color")) {
        splats.color = colorOption(a, "color");
        return;
    }
    if (splats.x.empty()) return; // no points yet, so no speed or age
    const Points* points = pointsOf(c);
    auto by = a.choice<SplatValue>("show");
    if (!a.given("show") && points && !points->hasVelocity()) by = SplatValue::height;
    splats.values = points ? splatValues(*points, by, camera) : splatValues(*c.curves("what"), by, camera);
    const Interval range = a.given("range") ? a.interval("range") : splatRange(splats.values, by);
    if (!a.given("range") && by != SplatValue::age) warnOfRange(c, range, splats.values.size());
    splats.scale = {.map = a.choice<ColorMap>("map"),
                    .lower = static_cast<float>(range.lower),
                    .upper = static_cast<float>(range.upper)};
}

/// Returns the domain whose wall is outlined: that of a 3D flow, or the inside of a shape or level set.
std::optional<Domain> outlined(const Context& c, const Arguments& a) {
    if (!c.has("wall") || c.has("image") || a.real("outline") == 0) return {};
    Domain domain;
    if (c.kind("wall") != Kind::flow)
        domain = Domain::of({.sdf = c.sdf("wall", 0), .side = Side::inside});
    else if (dimensionOf(c.anyFlow("wall")) == 3)
        domain = c.flow("wall").domain();
    if (!domain.wall || !domain.box.finite()) return {};
    return domain;
}

/// Returns the camera of a picture.
Camera viewOf(const Context& c, const Arguments& a, const Splats& splats, const std::optional<Domain>& domain) {
    if (a.given("viewBox")) return cameraOf(a, a.box("viewBox"));
    if (a.given("eye")) return cameraOf(a, splats.x.empty() ? Domain{}.box : splats.bounds());
    if (!c.clock() || !domain) return framing(splats, domain, viewpointOf(a));
    const bool contained = domain->wall->side == Side::inside;
    return contained ? framing(Splats{}, domain, viewpointOf(a)) : cameraOf(a, domain->box);
}

/// Returns one camera for all frames. If no flow, shape or level set determines the view, the camera is that of the
/// first frame with points; earlier frames are empty anyway.
Camera cameraOfSplats(const Context& c, const Arguments& a, const Splats& splats, const std::optional<Domain>& domain) {
    auto& kept = keptFromFrames(c).camera;
    if (c.clock() && kept) return *kept;
    const bool nothing = splats.x.empty() && !domain && !a.given("viewBox") && !a.given("eye");
    const Camera camera = nothing ? cameraOf(a, Domain{}.box) : viewOf(c, a, splats, domain);
    if (c.clock() && !nothing && !a.changes()) kept = camera;
    return camera;
}

/// Returns the background of the splats: another picture, or the wall. An obstacle hides the splats behind it; other
/// walls are transparent.
Image groundOf(const Context& c, const Arguments& a, const ImageValue* behind, const std::optional<Domain>& domain,
               const Camera& camera) {
    if (behind) return behind->image;
    const Vec3f background = colorOption(a, "background");
    const bool obstacle = domain && domain->wall->side == Side::outside;
    Image ground = obstacle ? obstaclePicture(*domain, camera, background, c.follow("rendering the wall"))
                            : plainPicture(camera.width(), camera.height(), background);
    if (!domain) return ground;
    return withWallOutline(std::move(ground), *domain, camera, a.real("outline"),
                           c.follow("rendering the wall's outline"));
}

void splatAction(Context& c, const Arguments& a) {
    const Points* points = pointsOf(c);
    Splats splats = points ? Splats::of(*points) : Splats::of(*c.curves("what"));
    const ImageValue* behind = c.has("image") ? &c.image("image") : nullptr;
    if (behind && (!behind->camera || !rgbChannels(behind->image)))
        throw ValueError("over=1 needs a perspective picture, of -shade or -splat, as the newest image");
    const auto domain = outlined(c, a);
    const Camera camera = behind ? *behind->camera : cameraOfSplats(c, a, splats, domain);
    color(splats, c, a, camera);
    const bool light = a.choice("look") == 0;
    // The ground, the splats and the result; a halo takes two blurred copies.
    const double floats = light ? (a.real("glow") > 0 ? 15 : 9) : 12;
    requireMemory(floats * sizeof(float) * camera.width() * camera.height(),
                  fmt::format("a picture of {} x {} pixels", camera.width(), camera.height()),
                  "choose a smaller width");
    Image ground = groundOf(c, a, behind, domain, camera);
    const SplatImage made = (light ? luminous : opaque)(splats, camera,
                                                        {.radius = a.given("pointRadius") ? a.real("pointRadius") : 0,
                                                         .pixels = a.real("pixels"),
                                                         .fade = a.real("fade")},
                                                        depthOf(ground), c.follow("splat"));
    double exposure = 0;
    Image picture;
    if (light) {
        exposure = a.real("exposure") * automaticExposure(made.image);
        picture = developed(withGlow(made.image, a.real("glow")), exposure, std::move(ground));
    } else {
        picture = composite(made.image, ground);
    }
    const size_t drawable = points ? splats.x.size() : c.curves("what")->edges();
    c.info(fmt::format("splat: {} of {} {} drawn in {} x {} pixels, {:.1f} % of which they cover", made.drawn, drawable,
                       points ? "points" : "edges", camera.width(), camera.height(), 100 * made.covered));
    c.report("splat") = {{"drawn", made.drawn}, {"covered", made.covered}, {"exposure", exposure}};
    c.give(std::make_shared<const ImageValue>(ImageValue{.image = std::move(picture), .camera = camera}));
}

std::vector<Option> splatOptions() {
    const auto upToOne = [](std::string name, std::string fallback, std::string help) {
        Option option = notNegative(std::move(name), std::move(fallback), "", std::move(help));
        option.upper = 1;
        return option;
    };
    const SplatOptions o;
    std::vector<Option> all{
        choice("look", {"luminous", "opaque"},
               "luminous: light that adds up; opaque: balls and tubes that occlude each other"),
        formerly(
            {"by"},
            choice(
                "show", kSplatValueNames,
                "quantity that the colour shows: speed, height or depth in the picture, a random number for each id, "
                "the order, or the time since birth (for curves: the length or time from the seed); points without "
                "velocity show the height")),
        choice("map", kColorMapNames, "colour map"),
        interval("range", "", "values at the two ends of the colour map (default: percentiles 2 and 98)"),
        instead(vector("color", "", "", "a single colour instead of the map: sRGB from 0 to 1"), {"show", "map"}),
        formerly({"radius"},
                 positive("pointRadius", "", "world units", "radius of points and lines (default: from pixels=)")),
        positive("pixels", fmt::format("{}", o.pixels), "pixels",
                 "minimum radius in the picture; smaller points and lines get fainter instead"),
        upToOne("fade", fmt::format("{}", o.fade), "how much fainter the farthest points are than the nearest, 0 to 1"),
        onlyWith({"look=luminous"},
                 positive("exposure", "1", "", "factor by which the automatic exposure is multiplied")),
        onlyWith({"look=luminous"}, upToOne("glow", "0.15", "fraction of the light that forms a halo (glow), 0 to 1")),
        notNegative("outline", "0.35", "",
                    "brightness of the edges of the flow's wall or, without a flow, of the shape. A container is drawn "
                    "as glass, an obstacle as solid; 0: the wall is not drawn"),
        vector("background", "0.012,0.016,0.03", "", "background colour: sRGB from 0 to 1"),
        selector(flag("over", "0", "1: draw on the newest picture, with its camera, hidden by nearer surfaces in it")),
        ages("geo", "", "points or curves to draw: 0 is the newest geometry (default: the newest points or curves)"),
        formerly(
            {"box"},
            viewBoxOption("all that is drawn, except stray points, and the wall; after -frames the wall's domain, or "
                          "else the box of the first frame with points"))};
    const auto camera = cameraOptions();
    all.insert(all.end(), camera.begin(), camera.end());
    return all;
}

Input wallInput() {
    Input wall = maybe(stays("wall", {Kind::flow, Kind::shape, Kind::levelSet}),
                       "optional; its outline is drawn if outline= is above 0");
    wall.firstKindFirst = true;
    wall.amountWith = [](const Arguments& a, const Scope& scope) {
        const bool shown = everNonzero(a, "outline") && (scope.linked() || !a.flag("over"));
        return Amount{0, shown ? size_t{1} : 0};
    };
    return wall;
}

} // namespace

Registry splatActions() {
    return {
        {.name = "splat",
         .group = "pictures",
         .summary = "render the newest points or curves (particles, streamlines) as light or as balls and tubes",
         .takes = {stays("what", {Kind::points, Kind::curves}, "geo"), wallInput(),
                   onRequest(changed("image", {Kind::image}), "only with over=1: the picture to draw on",
                             [](const Arguments& a) { return a.flag("over"); })},
         .makes = {made("image", {Kind::image})},
         .options = splatOptions(),
         .examples = {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn speed=1 -scatter "
                      "count=2000 -trace maxLength=3 -splat -write curves.png",
                      "curlew -torus -jitter count=3000 -splat look=opaque pointRadius=0.02 map=ember -write balls.png",
                      "curlew -noise dimensions=2 -dfvn -scatter count=3000 -trace -splat from=0,0,1 fov=0.1 "
                      "-write flat.png"},
         .run = splatAction}};
}

} // namespace curlew::app
