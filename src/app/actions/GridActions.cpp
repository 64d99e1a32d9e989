// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "curlew/app/registry/Text.h"
#include "curlew/flow/FlowScale.h"
#include "curlew/vdb/MeshSolid.h"
#include "curlew/vdb/ScalarGrids.h"
#include "curlew/vdb/VelocityGrid.h"

#include <utility>

namespace curlew::app {

namespace {

using namespace options;

const std::string kGroup = "grids";

/// What was found about a mesh that is not simply closed.
std::string descriptionOf(const SolidFigures& figures) {
    std::vector<std::string> parts;
    if (figures.boundaryEdges > 0)
        parts.push_back(
            fmt::format("open ({} edges have a face on one side only; {:.2g} % of the voxels beside it are "
                        "undecided)",
                        figures.boundaryEdges, 100 * figures.undecided));
    if (figures.hidden > 0.0005)
        parts.push_back(fmt::format("{:.1f} % of its surface lies inside or bounds nothing", 100 * figures.hidden));
    if (figures.turned) parts.push_back("its faces run clockwise as seen from outside, and count as turned");
    if (figures.duplicateFaces > 0) parts.push_back(fmt::format("{} faces are duplicates", figures.duplicateFaces));
    if (figures.degenerateFaces > 0) parts.push_back(fmt::format("{} faces are degenerate", figures.degenerateFaces));
    return join(parts, "; ");
}

void warnOfSolid(const Context& c, const SolidFigures& figures, double voxel) {
    if (figures.undecided > 0.5)
        c.warn(
            fmt::format("the mesh is more a sheet than a solid: {:.0f} % of the voxels beside it are neither inside "
                        "nor outside; thickness={:.3g} makes an obstacle of it that is four voxels thick",
                        100 * figures.undecided, 4 * voxel));
    else if (figures.meanThickness > 0 && figures.meanThickness < 2)
        c.warn(
            fmt::format("what the mesh encloses is {:.2g} voxels thick on average; if it should enclose more, close "
                        "its holes or turn its faces; if not, use smaller voxels, or thickness={:.3g}",
                        figures.meanThickness, 4 * voxel));
    if (figures.thin > 0.005)
        c.warn(
            fmt::format("thin parts: {:.1f} % of the surface belongs to parts thinner than a voxel, which the level "
                        "set lacks; use voxels smaller than {:.3g}",
                        100 * figures.thin, voxel));
}

void meshToLevelSetAction(Context& c, const Arguments& a) {
    const double thickness = a.given("thickness") ? a.real("thickness") : 0;
    const auto [levelSet, figures] = solidOf(c.mesh("mesh"),
                                             {.voxel = a.given("voxel") ? a.real("voxel") : 0,
                                              .dim = a.integer<int>("dim"),
                                              .halfWidth = a.real("width"),
                                              .thickness = thickness},
                                             c.follow("mesh to level set"));
    c.say(fmt::format("level set: {} voxels of {:.6g}", levelSet.grid->activeVoxelCount(), levelSet.voxelSize()));
    if (const std::string description = descriptionOf(figures); thickness == 0 && !description.empty())
        c.say("the mesh: " + description);
    if (thickness > 0 && thickness < 2 * levelSet.voxelSize())
        c.warn(fmt::format("thickness {:.3g} is below two voxels of {:.3g}: the sheet may have gaps", thickness,
                           levelSet.voxelSize()));
    warnOfSolid(c, figures, levelSet.voxelSize());
    c.report("mesh2ls") = {{"voxels", levelSet.grid->activeVoxelCount()},
                           {"boundary_edges", figures.boundaryEdges},
                           {"duplicate_faces", figures.duplicateFaces},
                           {"degenerate_faces", figures.degenerateFaces},
                           {"clean", figures.clean},
                           {"turned", figures.turned},
                           {"undecided", figures.undecided},
                           {"hidden", figures.hidden},
                           {"thin", figures.thin},
                           {"mean_thickness_voxels", figures.meanThickness}};
    c.give(GridValue{levelSet.grid, levelSet.mesh});
}

/// Says once, and not in every frame, if the voxels are too large for the flow.
void warnOfCoarseVoxels(const Context& c, const Flow& flow, double voxel) {
    constexpr double kRoundedDown = 0.95; // so that two digits are enough
    if (std::exchange(c.memory().object, std::make_shared<bool>(true))) return;
    const double wavelength = wavelengthOf(flow, c.follow("the flow's wavelength")), voxels = wavelength / voxel;
    if (!(wavelength > 0) || voxels >= kVoxelsPerWavelength) return;
    c.warn(
        fmt::format("the flow varies over a wavelength of {:.3g}, which has {:.2g} voxels, so details are lost: "
                    "voxel={:.2g} gives it {}, or choose a lower frequency or fewer octaves",
                    wavelength, voxels, kRoundedDown * wavelength / kVoxelsPerWavelength, kVoxelsPerWavelength));
}

/// How the wall of the flow moves now: as it has come here from the frame before, or goes on from the first one.
std::optional<WallVelocity> movingWall(const Context& c) {
    const double frame = c.clock() && c.clock()->duration > 0 ? -c.clock()->duration : 1 / c.moment().fps;
    return wallVelocity(c.flowInTime("flow"), c.moment().time, frame);
}

std::string motionOf(const std::optional<WallVelocity>& moving) {
    if (!moving) return "";
    return moving->rigid() ? ", with the motion of the wall"
                           : ", with the motion of the wall, which changes its form: that part has a divergence";
}

void velocity(Context& c, const Arguments& a) {
    Flow flow = c.flow("flow");
    Domain domain = flow.domain();
    if (a.given("padding") && domain.wall) domain = Domain::of(*domain.wall, a.real("padding"));
    if (a.given("box")) domain.box = a.box("box");
    flow = flow.within(domain);
    const VelocityGridOptions options{.voxel = a.given("voxel") ? a.real("voxel") : 0,
                                      .dim = a.integer<int>("dim"),
                                      .layout = a.flag("staggered") ? Layout::staggered : Layout::collocated,
                                      .mask = c.has("mask") ? c.grid("mask").grid : nullptr,
                                      .wallFade = a.real("skin"),
                                      .moving = movingWall(c)};
    const auto grid = velocityGrid(flow, options, c.follow("velocity"));
    if (grid->activeVoxelCount() == 0)
        throw ValueError("the grid has no active voxel: the domain is thinner than a voxel; choose smaller voxels");
    grid->setName(a.text("name"));
    c.say(fmt::format("velocity: {} active voxels of {:.6g}{}", grid->activeVoxelCount(), grid->voxelSize()[0],
                      motionOf(options.moving)));
    warnOfCoarseVoxels(c, flow, grid->voxelSize()[0]);
    const auto give = [&](const openvdb::GridBase::Ptr& made) {
        made->setSaveFloatAsHalf(a.flag("half"));
        made->setCreator("Curlew");
        c.give(GridValue{made});
    };
    if (a.flag("potentials")) {
        if (!flow.hasTracks()) throw ValueError("potentials=1 needs a flow with tracks, and this one is a sum");
        give(sampledGrid(flow.g(), *grid, "g", c.follow("g")));
        give(sampledGrid(flow.f(), *grid, "f", c.follow("f")));
    }
    if (a.flag("density")) give(densityGrid(flow.domain(), *grid, c.follow("density")));
    give(grid);
}

} // namespace

Registry gridActions() {
    return {
        {.name = "mesh2ls",
         .group = kGroup,
         .summary = "turn a mesh into a level set: open, overlapping or broken, as it is",
         .takes = {taken("mesh", {Kind::mesh}, "geo")},
         .makes = {made("levelSet", {Kind::levelSet})},
         .options = {integer("dim", "256", 1, 1e6, "voxels along the longest edge of the mesh's box"),
                     instead(positive("voxel", "", "world units", "voxel size (default: from dim)"), {"dim"}),
                     {.name = "width",
                      .type = OptionType::real,
                      .fallback = "3",
                      .help = "half width of the narrow band; -bound widens it where it needs more",
                      .unit = "voxels",
                      .lower = 1,
                      .upper = 1000},
                     positive("thickness", "", "world units",
                              "the mesh is a sheet, such as cloth or terrain, of this thickness, half on either side "
                              "(default: a solid; holes are closed)"),
                     ages("geo", "", "which geometry (default: the newest mesh)"),
                     keep()},
         .examples = {"curlew -read bunny.obj -mesh2ls voxel=0.01 -write bunny.vdb"},
         .run = meshToLevelSetAction},
        {.name = "velocity",
         .group = kGroup,
         .summary = "sample the newest flow on a sparse grid",
         .takes = {stays("flow", {Kind::flow}), onRequest(stays("mask", {Kind::grid}, "mask"), "if mask= chooses one",
                                                          [](const Arguments& given) { return given.given("mask"); })},
         .makes = {made("g", {Kind::grid}, "potentials"), made("f", {Kind::grid}, "potentials"),
                   made("density", {Kind::grid}, "density"), made("velocity", {Kind::velocity})},
         .options = {integer("dim", "128", 1, 1e6, "voxels along the longest edge of the domain's box"),
                     instead(positive("voxel", "", "world units", "voxel size (default: from dim)"), {"dim"}),
                     flag("staggered", "0",
                          "1: components on voxel faces (MAC), divergence-free to rounding; for solvers. 0: at "
                          "centres; for Blender, RenderMan and most others"),
                     text("name", "vel", "of the grid; hosts look for vel, v or velocity"),
                     flag("half", "0", "write with 16 bits a value"),
                     box("box", "sample here (default: the domain of the flow)"),
                     notNegative("padding", "", "world units",
                                 "how far around an obstacle to sample (default: the domain of the flow)"),
                     ages("mask", "", "a grid whose active voxels, and no others, are sampled, in its resolution"),
                     {.name = "skin",
                      .type = OptionType::real,
                      .fallback = "3",
                      .help = "how far the grid reaches beyond the wall, fading to zero",
                      .unit = "voxels",
                      .lower = 1,
                      .upper = 100},
                     flag("density", "0", "also make a fog volume 'density' of the domain"),
                     flag("potentials", "0", "also make grids 'f' and 'g' of the potentials")},
         .examples = {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn speed=1 -velocity "
                      "voxel=0.02 density=1 -write grid=0,1 smoke.vdb"},
         .run = velocity}};
}

} // namespace curlew::app
