// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "CameraOptions.h"
#include "SurfaceColors.h"
#include "curlew/render/SurfaceShading.h"

namespace curlew::app {

namespace {

using namespace options;

/// The isosurface of a field, or a shape, a level set or a mesh.
Surface subjectOf(const Context& c, const Arguments& a) {
    if (a.given("iso")) {
        const FieldValue& value = c.field("field");
        const auto shape = value.sdf ? boxOf(*value.sdf) : std::nullopt;
        const Box box = a.given("box") ? a.box("box") : shape.value_or(Domain{}.box);
        return {inSpace(value.field), a.real("iso"), box, !a.flag("sheet")};
    }
    if (c.kind("surface") == Kind::shape) {
        const Sdf sdf = c.sdf("surface", 0);
        return {sdf, a.given("box") && !sdf.bounds.finite() ? a.box("box") : sdf.bounds};
    }
    // A mesh is drawn as it is, unless it is to be smoothed, or seen at the resolution of a grid.
    if (c.kind("surface") == Kind::mesh && !a.given("dim") && a.integer("smooth") == 0)
        return Surface(*c.mesh("surface"));
    const LevelSet levelSet =
        c.kind("surface") == Kind::levelSet
            ? c.levelSet("surface", 0) // its band is wide enough for the spline
            : meshToLevelSet(c.mesh("surface"), {.dim = a.integer<int>("dim")}, c.follow("mesh to level set"));
    return Surface(smoothed(levelSet, a.integer<int>("smooth")));
}

void shade(Context& c, const Arguments& a) {
    const Surface surface = subjectOf(c, a);
    const ImageValue* behind = c.has("image") ? &c.image("image") : nullptr;
    if (behind && !behind->camera)
        throw ValueError("over=1 needs a picture that -shade has made, whose camera it takes");
    const Camera camera = behind ? *behind->camera
                          : a.given("box") || a.given("eye")
                              ? cameraOf(a, a.given("box") ? a.box("box") : surface.box())
                              : framing(surface, viewpointOf(a));
    const SurfacePaint paint = paintOf(c, a, surface.box());
    SurfaceLook look{.background = colorOption(a, "background"), .gloss = a.real("gloss")};
    if (a.flag("outline")) look.finish = Finish::outline;
    if (paint.texture == Texture::film) look.finish = Finish::mirror;
    if (a.given("light")) look.light = a.vector("light");
    const SurfaceView view = viewSurface(surface, camera, a.integer<int>("samples"), c.follow("rays"));
    const Image* before = behind ? &behind->image : nullptr;
    const auto shaded = [&](const SurfaceView& seen) {
        const Monitor monitor = c.follow("shading");
        const PaintedColors painted = paintedColors(seen, paint, monitor);
        if (const auto& carried = painted.carried)
            c.report("shade_carried") = {{"not_converged", carried->notConverged},
                                         {"retries", carried->retries},
                                         {"iterations_mean", carried->meanIterations}};
        return shadeSurface(seen, painted.colors, look, a.flag("shadow") ? &surface : nullptr, before, monitor);
    };
    Image farSide;
    if (look.finish == Finish::mirror) { // one sees its far side too
        farSide = shaded(viewThrough(surface, view));
        before = &farSide;
    }
    Image image = shaded(view);
    c.report("shade") = {{"hits", view.hits.size()}, {"coverage", view.coverage()}};
    if (view.hits.empty()) c.warn("the camera sees nothing of the surface");
    c.give(std::make_shared<const ImageValue>(ImageValue{.image = std::move(image), .camera = camera}));
}

std::vector<Option> shadeOptions() {
    const SurfaceLook look;
    std::vector<Option> all = colorOptions(), camera = cameraOptions();
    all.insert(
        all.end(),
        {real("iso", "", "",
              "show where the newest field has this value, in its box, instead of a mesh, level set or shape"),
         flag("sheet", "0", "1: an isosurface is open where the box cuts it; 0: what is below the value is solid"),
         box("box",
             "where an isosurface, or a shape without end, is cut; and what the camera has to see (default: the "
             "surface's own)"),
         integer("dim", fmt::format("{}", MeshToLevelSetOptions{}.dim), 8, 4096,
                 "show a mesh as a level set with so many voxels along its longest edge (default: the mesh itself)"),
         integer("smooth", "0", 0, 32,
                 "voxels over which a level set, or that of a mesh, is smoothed, so that facets do not show"),
         flag("outline", "0", "1: only a faint rim, which hides nothing: for what is inside"),
         selector(flag("over", "0", "1: into the newest picture that -shade has made, by depth and with its camera")),
         flag("shadow", "1", "whether it throws shadows on itself"),
         vector("light", "", "", "where the key light is (default: over the camera's left shoulder)"),
         notNegative("gloss", fmt::format("{}", look.gloss), "", "of its highlight and rim"),
         vector("background", fmt::format("{}", fmt::join(look.background.c, ",")), "", "sRGB from 0 to 1"),
         integer("samples", "3", 1, 16, "along each edge of a pixel")});
    all.insert(all.end(), camera.begin(), camera.end());
    return all;
}

std::vector<Input> shadeInputs() {
    const auto iso = [](const Arguments& a) { return a.given("iso"); };
    std::vector<Input> all = colorInputs();
    all.insert(all.begin(),
               {onlyIf(stays("surface", {Kind::mesh, Kind::levelSet, Kind::shape}), "not with iso=", std::not_fn(iso)),
                onlyIf(stays("field", {Kind::field}), "only with iso=", iso)});
    all.push_back(onRequest(changed("image", {Kind::image}), "only with over=1: what is drawn into",
                            [](const Arguments& a) { return a.flag("over"); }));
    return all;
}

} // namespace

Registry surfaceActions() {
    return {{.name = "shade",
             .group = "pictures",
             .summary = "a picture of the newest mesh, level set or shape, or of where a field has a value",
             .takes = shadeInputs(),
             .makes = {made("image", {Kind::image})},
             .options = shadeOptions(),
             .examples = {"curlew -read scenes/spot.obj -shade from=-1,0.4,-1 -write spot.png",
                          "curlew -noise frequency=2 -shade iso=0 sheet=1 -write sheets.png",
                          "curlew -torus -noise frequency=3 -shade show=value -write torus.png torus.exr"},
             .run = shade}};
}

} // namespace curlew::app
