#include "CameraOptions.h"
#include "Options.h"
#include "SurfaceColors.h"
#include "curlew/app/Registry.h"
#include "curlew/app/Session.h"

namespace curlew::app {

namespace {

using namespace options;

const std::string kGroup = "pictures";

/// The surface to show: an isosurface of the newest field, or the newest mesh, level set or shape.
Surface subjectOf(Session& s, const Arguments& a) {
    if (a.given("iso")) {
        const FieldObject& object = s.fields.at();
        const bool bounded = object.sdf && object.sdf->bounds.finite();
        const Box box = a.given("box") ? a.box("box") : bounded ? object.sdf->bounds : Domain{}.box;
        return {inSpace(object.field), a.real("iso"), box, !a.flag("sheet")};
    }
    std::shared_ptr<const Mesh> mesh;
    uint64_t made = 0;
    for (size_t k = 0; k < s.geometry.size() && !mesh; ++k)
        if (const auto* found = std::get_if<std::shared_ptr<const Mesh>>(&s.geometry.at(k))) {
            mesh = *found;
            made = s.geometry.entry(k).made;
        }
    const auto shape = s.newestField(true), grid = s.newestLevelSet();
    const uint64_t shapeMade = shape ? s.fields.entry(*shape).made : 0;
    const uint64_t gridMade = grid ? s.grids.entry(*grid).made : 0;
    if (std::max({made, shapeMade, gridMade}) == 0)
        throw ValueError("there is no mesh, level set or shape to show; make one, or give iso= for a field");
    if (shapeMade > std::max(made, gridMade)) {
        const Sdf& sdf = *s.fields.at(*shape).sdf;
        return {sdf, a.given("box") && !sdf.bounds.finite() ? a.box("box") : sdf.bounds};
    }
    const auto smooth = static_cast<int>(a.integer("smooth"));
    if (made > gridMade)
        return Surface(smoothed(meshToLevelSet(mesh, {.dim = static_cast<int>(a.integer("dim")), .open = true},
                                               s.console.follow("mesh to level set")),
                                smooth));
    s.levelSetSdf(*grid, 0); // its band is wide enough for the spline on return
    return Surface(smoothed(levelSetOf(s.grids.at(*grid).grid), smooth));
}

void shade(Session& s, const Arguments& a) {
    const Surface surface = subjectOf(s, a);
    const ImageObject* behind = a.flag("over") ? &s.images.at() : nullptr;
    if (behind && !behind->camera)
        throw ValueError("over=1 needs a picture that -shade has made, whose camera it takes");
    const Camera camera = behind ? *behind->camera
                          : a.given("box") || a.given("eye")
                              ? cameraOf(a, a.given("box") ? a.box("box") : surface.box())
                              : framing(surface, viewpointOf(a));
    const Painter painter = painterOf(s, a, surface.box());
    SurfaceLook look{.background = colorOption(a, "background"), .gloss = a.real("gloss")};
    if (a.flag("outline")) look.finish = Finish::outline;
    if (paintsFilm(a)) look.finish = Finish::mirror;
    if (a.given("light")) look.light = a.vector("light");
    const SurfaceView view =
        viewSurface(surface, camera, static_cast<int>(a.integer("samples")), s.console.follow("rays"));
    const uint64_t made = s.now();
    const Image* before = behind ? &behind->image : nullptr;
    const auto shaded = [&](const SurfaceView& seen) {
        const Monitor monitor = s.console.follow("shading");
        return shadeSurface(seen, painter(seen, monitor), look, a.flag("shadow") ? &surface : nullptr, before, monitor);
    };
    Image farSide;
    if (look.finish == Finish::mirror) { // one sees its far side too
        farSide = shaded(viewThrough(surface, view));
        before = &farSide;
    }
    Image image = shaded(view);
    s.report["shade"] = {{"hits", view.hits.size()}, {"coverage", view.coverage()}};
    if (view.hits.empty()) s.console.warn("the camera sees nothing of the surface");
    if (behind) s.images.take();
    s.images.push({.image = std::move(image), .camera = camera}, made);
}

} // namespace

std::vector<Action> surfaceActions() {
    std::vector<Option> options = colorOptions();
    for (Option& option : std::vector<Option>{
             real("iso", "", "",
                  "show where the newest field has this value, in its box, instead of a mesh, level set or shape"),
             flag("sheet", "0", "1: an isosurface is open where the box cuts it; 0: what is below the value is solid"),
             box("box",
                 "where an isosurface, or a shape without end, is cut; and what the camera has to see (default: the "
                 "surface's own)"),
             integer("dim", "256", 8, 4096, "voxels along the longest edge of a mesh"),
             integer("smooth", "0", 0, 32,
                     "voxels over which a mesh or level set is smoothed, so that its facets do not show"),
             flag("outline", "0", "1: only a faint rim, which hides nothing: for what is inside"),
             flag("over", "0", "1: into the newest picture that -shade has made, by depth and with its camera"),
             flag("shadow", "1", "whether it throws shadows on itself"),
             vector("light", "", "", "where the key light is (default: over the camera's left shoulder)"),
             notNegative("gloss", "0.15", "", "of its highlight and rim"),
             vector("background", "0.11,0.115,0.125", "", "sRGB from 0 to 1"),
             integer("samples", "3", 1, 16, "along each edge of a pixel")})
        options.push_back(std::move(option));
    for (Option& option : cameraOptions()) options.push_back(std::move(option));
    return {{.name = "shade",
             .group = kGroup,
             .summary = "a picture of the newest mesh, level set or shape, or of where a field has a value",
             .inputs = "mesh, level set, shape or field (which stays)",
             .outputs = "image",
             .takes = {maybe(stays("surface", {Kind::mesh, Kind::levelSet, Kind::shape}), "with iso= there is none"),
                       maybe(stays("field", {Kind::field, Kind::flow}), "where iso= or show= asks for it"),
                       maybe(changed("image", {Kind::image}), "only with over=1: what is drawn into")},
             .makes = {made("image", {Kind::image})},
             .options = std::move(options),
             .examples = {"curlew -read scenes/spot.obj -shade from=-1,0.4,-1 -write spot.png",
                          "curlew -noise frequency=2 -shade iso=0 sheet=1 -write sheets.png",
                          "curlew -torus -noise frequency=3 -shade show=value -write torus.png torus.exr"},
             .run = shade}};
}

} // namespace curlew::app
