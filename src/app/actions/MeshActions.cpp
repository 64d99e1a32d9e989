// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "curlew/app/registry/Bind.h"
#include "curlew/app/run/Context.h"
#include "curlew/vdb/FieldMesh.h"

namespace curlew::app {

namespace {

using namespace options;

const Binding<IsosurfaceOptions>& isosurfaceBinding() {
    static const auto binding =
        Binding<IsosurfaceOptions>()
            .add(
                real("iso", "", "", "3D: value of the field on the surface"), [](auto& o) -> auto& { return o.iso; })
            .add(
                integer("dim", "", 1, 1e5, "number of voxels (3D) or quads (2D) along the longest edge of the box"),
                [](auto& o) -> auto& { return o.dim; })
            .addOptional(
                instead(positive("voxel", "", "world units", "size of the faces (default: from dim=)"), {"dim"}),
                [](auto& o) -> auto& { return o.voxel; })
            .add(
                {.name = "adaptivity",
                 .type = OptionType::real,
                 .help = "mesh simplification where the surface is flat, 0 to 1; 0: quads of the size of a voxel",
                 .lower = 0,
                 .upper = 1},
                [](auto& o) -> auto& { return o.adaptivity; })
            .add(
                choice("inside", {"below", "above"},
                       "3D: where the field is inside the surface: below iso, as a distance, or above it, as a "
                       "density"),
                [](auto& o) -> auto& { return o.reversed; });
    return binding;
}

Mesh heights(const Context& c, const Arguments& a, const ScalarFieldN<2>& field) {
    for (const char* option : {"iso", "inside", "adaptivity"})
        if (a.given(option))
            throw ValueError(fmt::format("{}= is for fields of 3 dimensions; this one has 2: a height field", option));
    HeightMeshOptions options{.dim = a.integer<int>("dim")};
    if (a.given("voxel")) options.edge = a.real("voxel");
    if (a.given("box")) {
        const Box box = a.box("box");
        for (int axis = 0; axis < 2; ++axis) {
            options.box.lower[axis] = box.lower[axis];
            options.box.upper[axis] = box.upper[axis];
        }
    }
    return heightMesh(field, options, c.follow("mesh"));
}

/// Warns if the surface ends at the sides of the box, which nobody has chosen.
void warnOfCut(const Context& c, const Mesh& mesh, const IsosurfaceOptions& options) {
    const Box& box = options.box;
    const Vec3d size = box.size();
    const double near = options.voxel > 0 ? options.voxel : std::max({size[0], size[1], size[2]}) / options.dim;
    const auto cut = std::count_if(mesh.points.begin(), mesh.points.end(), [&](const auto& p) {
        for (int axis = 0; axis < 3; ++axis) {
            const auto x = static_cast<double>(p[axis]);
            if (x < box.lower[axis] + near || x > box.upper[axis] - near) return true;
        }
        return false;
    });
    if (cut > 0 && !topologyOf(mesh).closed())
        c.warn(
            fmt::format("the surface is cut off at the sides of the box {:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g}, "
                        "where {} of its {} points are; give box= to choose the region",
                        box.lower[0], box.lower[1], box.lower[2], box.upper[0], box.upper[1], box.upper[2], cut,
                        mesh.points.size()));
}

Mesh surfaceIn(const Context& c, const Arguments& a, const ScalarField& field) {
    IsosurfaceOptions options = isosurfaceBinding().read(a);
    options.box = Box{}.padded(1);
    const FieldValue& value = c.field("field");
    if (a.given("box"))
        options.box = a.box("box");
    else if (const auto region = regionOfSurface(value, options.iso))
        options.box = *region;
    Mesh mesh = isosurface(field, options, c.follow("mesh"));
    if (!a.given("box")) warnOfCut(c, mesh, options);
    return mesh;
}

void meshOfField(Context& c, const Arguments& a) {
    const AnyField& field = c.field("field").field;
    const auto* flat = std::get_if<ScalarFieldN<2>>(&field);
    const auto* spatial = std::get_if<ScalarField>(&field);
    if (!flat && !spatial)
        throw ValueError(fmt::format("needs a field of 2 or 3 dimensions, but the newest has {}", dimensionOf(field)));
    auto mesh = std::make_shared<const Mesh>(flat ? heights(c, a, *flat) : surfaceIn(c, a, *spatial));
    c.info(fmt::format("mesh: {} points, {} faces", mesh->points.size(), mesh->faces()));
    c.give(std::move(mesh));
}

} // namespace

Registry meshActions() {
    std::vector<Option> options = isosurfaceBinding().options();
    options.push_back(
        box("box", "region of the surface (default: the box of a shape, padded, or of a grid, else -1,-1,-1,1,1,1)"));
    options.push_back(keep());
    return {{.name = "mesh",
             .group = "fields",
             .summary = "the newest field as a mesh with normals: an isosurface (3D) or a height field (2D)",
             .details =
                 "Vertices lie on the surface, and their normals are the field's gradients. A height field is the "
                 "surface z = field(x, y), with UVs over the box. Written to .ply and .obj with its normals and UVs.",
             .takes = {taken("field", {Kind::field})},
             .makes = {made("mesh", {Kind::mesh})},
             .options = std::move(options),
             .examples = {"curlew -noise type=perlin dimensions=2 octaves=6 -mesh dim=200 -write terrain.obj",
                          "curlew -sphere -noise frequency=1.5 octaves=3 amplitude=0.17 -subtract -mesh "
                          "box=-1.5,-1.5,-1.5,1.5,1.5,1.5 dim=100 -write displaced.ply"},
             .run = meshOfField}};
}

} // namespace curlew::app
