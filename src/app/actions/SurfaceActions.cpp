// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "CameraOptions.h"
#include "SurfaceColors.h"
#include "curlew/render/SurfacePicture.h"
#include "curlew/track/Diagnostics.h"

namespace curlew::app {

namespace {

using namespace options;

/// Returns the surface to draw: the isosurface of a field, or a shape, level set or mesh.
Surface subjectOf(const Context& c, const Arguments& a) {
    if (a.given("iso")) {
        const FieldValue& value = c.field("field");
        const auto region = value.sampled ? regionOfSurface(value, a.real("iso")) : regionOf(value);
        const Box box = a.given("box") ? a.box("box") : region.value_or(Domain{}.box);
        return {inSpace(value.field), a.real("iso"), box, !a.flag("sheet")};
    }
    if (c.kind("surface") == Kind::shape) {
        const Sdf sdf = c.sdf("surface", 0);
        return {sdf, a.given("box") && !sdf.bounds.finite() ? a.box("box") : sdf.bounds};
    }
    // A mesh is drawn directly unless smooth= or dim= asks for a level set.
    if (c.kind("surface") == Kind::mesh && !a.given("dim") && a.integer("smooth") == 0)
        return Surface(*c.mesh("surface"));
    const LevelSet levelSet =
        c.kind("surface") == Kind::levelSet
            ? c.levelSet("surface", 0) // with a narrow band that is wide enough for the spline
            : meshToLevelSet(c.mesh("surface"), {.dim = a.integer<int>("dim")}, c.follow("mesh to level set"));
    return Surface(smoothed(levelSet, a.integer<int>("smooth")));
}

/// Returns the region that the camera must show, if the options give one.
std::optional<Box> shownBy(const Arguments& a) {
    for (const char* name : {"viewBox", "box"})
        if (a.given(name)) return a.box(name);
    return {};
}

/// The camera of the frame before.
struct CameraBefore {
    Vec3d eye;
    bool warned = false; ///< That it moves.
};

/// Warns, once, if the camera is not where it was in the frame before, since each frame shows its whole surface.
void warnOfMovingCamera(const Context& c, const Camera& camera, const Box& subject) {
    constexpr double kMoves = 0.01; // of the subject's size
    if (!c.clock()) return;
    auto& object = c.memory().object;
    if (!object) object = std::make_shared<CameraBefore>(CameraBefore{.eye = camera.eye()});
    CameraBefore& before = *std::static_pointer_cast<CameraBefore>(object);
    const bool moves = length(camera.eye() - std::exchange(before.eye, camera.eye())) > kMoves * length(subject.size());
    if (!moves || std::exchange(before.warned, true)) return;
    c.warn(
        "the camera moves with the surface, since each frame shows all of it, so a film does not show how the "
        "surface moves; viewBox= or eye= keeps the camera in place");
}

/// Says why a picture shows nothing of the surface.
std::string whyNothing(const Context& c, const Arguments& a, const Surface& surface) {
    constexpr size_t kSamples = 20000;
    if (a.given("iso")) {
        const Interval range = diagnoseField(inSpace(c.field("field").field), surface.box(), kSamples).range;
        if (!range.contains(a.real("iso")))
            return fmt::format(
                "there is no isosurface at iso={:.6g}: in its box, samples of the field are between {:.4g} and {:.4g}",
                a.real("iso"), range.lower, range.upper);
    }
    return "the surface is outside the camera's view";
}

void shade(Context& c, const Arguments& a) {
    const Surface surface = subjectOf(c, a);
    const ImageValue* behind = c.has("image") ? &c.image("image") : nullptr;
    if (behind && (!behind->camera || behind->image.channels.back() != "Z"))
        throw ValueError("over=1 needs a picture with a camera and depth, of -shade or of -splat look=opaque");
    const auto region = shownBy(a);
    const Camera camera = behind                     ? *behind->camera
                          : region || a.given("eye") ? cameraOf(a, region.value_or(surface.box()))
                                                     : framing(surface, viewpointOf(a));
    if (!behind && !region && !a.given("eye") && !a.changes()) warnOfMovingCamera(c, camera, surface.box());
    SurfacePictureOptions options{.samples = a.integer<int>("supersampling"),
                                  .paint = paintOf(c, a, surface.box()),
                                  .look = {.background = colorOption(a, "background"), .gloss = a.real("gloss")},
                                  .shadows = a.flag("shadow")};
    if (a.flag("rimOnly")) options.look.finish = Finish::outline;
    if (options.paint.texture == Texture::film) options.look.finish = Finish::mirror;
    if (a.given("light")) options.look.light = a.vector("light");
    if (a.given("light") && !(length(options.look.light) > 0)) throw ValueError("light=0,0,0 has no direction");
    SurfacePicture picture =
        drawSurface(surface, camera, options, behind ? &behind->image : nullptr, c.follow("shading"));
    if (const auto& carried = picture.carried)
        c.report("shade_carried") = {{"not_converged", carried->notConverged},
                                     {"retries", carried->retries},
                                     {"iterations_mean", carried->meanIterations}};
    c.report("shade") = {{"hits", picture.hits}, {"coverage", picture.coverage}};
    if (picture.hits == 0) c.warn(whyNothing(c, a, surface));
    c.give(std::make_shared<const ImageValue>(ImageValue{.image = std::move(picture.image), .camera = camera}));
}

std::vector<Option> shadeOptions() {
    const SurfaceLook look;
    std::vector<Option> all = colorOptions(), camera = cameraOptions();
    all.insert(
        all.end(),
        {real("iso", "", "",
              "isovalue: show this isosurface of the newest field, in its box, instead of a mesh, level set or shape"),
         onlyWith({"iso="},
                  flag("sheet", "0",
                       "1: leave the isosurface open where the box cuts it; 0: treat values below iso= as solid")),
         box("box", "box that cuts off an isosurface or an unbounded shape (default: the surface's own)"),
         viewBoxOption("box=, or else the surface's own box, in each frame anew"),
         integer("dim", fmt::format("{}", SolidOptions{}.dim), 8, 4096,
                 "number of voxels along the longest edge of a mesh, which dim= or smooth= shows as a level set"),
         integer("smooth", "0", 0, 32,
                 "number of voxels over which a level set, or that of a mesh, is smoothed, to hide facets"),
         formerly({"outline"},
                  flag("rimOnly", "0", "1: draw only a faint rim that hides nothing, to show what is inside")),
         selector(flag(
             "over", "0",
             "1: draw into the newest picture, by depth and with its camera: one of -shade or -splat look=opaque")),
         flag("shadow", "1", "1: the surface casts shadows on itself"),
         vector("light", "", "", "direction to the key light (default: over the camera's left shoulder)"),
         notNegative("gloss", fmt::format("{}", look.gloss), "", "strength of the highlight and of the rim"),
         vector("background", fmt::format("{}", fmt::join(look.background.c, ",")), "",
                "background colour: sRGB from 0 to 1"),
         formerly({"samples"},
                  integer("supersampling", "3", 1, 16, "anti-aliasing: samples along each edge of a pixel"))});
    all.insert(all.end(), camera.begin(), camera.end());
    return all;
}

std::vector<Input> shadeInputs() {
    const auto iso = [](const Arguments& a) { return a.given("iso"); };
    std::vector<Input> all = colorInputs();
    all.insert(all.begin(), {onlyIf(stays("surface", {Kind::mesh, Kind::levelSet, Kind::shape}),
                                    "not used if iso= is given", std::not_fn(iso)),
                             onlyIf(stays("field", {Kind::field}), "only with iso=", iso)});
    all.push_back(onRequest(changed("image", {Kind::image}), "only with over=1: the picture to draw into",
                            [](const Arguments& a) { return a.flag("over"); }));
    return all;
}

} // namespace

Registry surfaceActions() {
    return {{.name = "shade",
             .group = "pictures",
             .summary = "render the newest mesh, level set or shape, or an isosurface of a field",
             .takes = shadeInputs(),
             .makes = {made("image", {Kind::image})},
             .options = shadeOptions(),
             .examples = {"curlew -read scenes/spot.obj -shade from=-1,0.4,-1 -write spot.png",
                          "curlew -noise frequency=2 -shade iso=0 sheet=1 -write sheets.png",
                          "curlew -torus -noise frequency=3 -shade show=value -write torus.png torus.exr"},
             .run = shade}};
}

} // namespace curlew::app
