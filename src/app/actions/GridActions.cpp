// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "GpuOption.h"
#include "MovingWall.h"
#include "curlew/app/language/Frames.h"
#include "curlew/app/registry/Text.h"
#include "curlew/base/Random.h"
#include "curlew/flow/FlowScale.h"
#include "curlew/vdb/DisplacedAir.h"
#include "curlew/vdb/MeshSolid.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/ScalarGrids.h"
#include "curlew/vdb/VelocityGrid.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace curlew::app {

namespace {

using namespace options;

const std::string kGridGroup = "grids";

/// Returns a member's default as that of an option.
std::string textOf(double value) { return fmt::format("{}", value); }

/// Describes the defects of a mesh that is not a closed manifold.
std::string descriptionOf(const SolidFigures& figures) {
    std::vector<std::string> parts;
    if (figures.boundaryEdges > 0)
        parts.push_back(
            fmt::format("open ({} boundary edges; {:.2g} % of the voxels next to it are neither inside nor outside)",
                        figures.boundaryEdges, 100 * figures.undecided));
    if (figures.hidden > 0.0005)
        parts.push_back(fmt::format("{:.1f} % of its surface is interior or encloses nothing", 100 * figures.hidden));
    if (figures.reversedFaces > 0)
        parts.push_back(figures.reversedFaces == 1
                            ? std::string("1 triangle runs against its neighbours, so it is reversed")
                            : fmt::format("{} triangles run against their neighbours, so they are reversed",
                                          figures.reversedFaces));
    if (figures.turnedShells > 0)
        parts.push_back(figures.turnedShells == 1
                            ? std::string("1 closed part is reversed, so it is flipped")
                            : fmt::format("{} closed parts are reversed, so they are flipped", figures.turnedShells));
    if (figures.turned)
        parts.emplace_back("its faces are clockwise seen from outside, so their orientation is reversed");
    if (figures.duplicateFaces > 0) parts.push_back(fmt::format("{} duplicate faces", figures.duplicateFaces));
    if (figures.degenerateFaces > 0) parts.push_back(fmt::format("{} degenerate faces", figures.degenerateFaces));
    return join(parts, "; ");
}

/// Returns a number with two digits, rounded down, so that a voxel of that size is small enough.
std::string roundedDown(double value) {
    const double unit = std::pow(10.0, std::floor(std::log10(value)) - 1);
    return fmt::format("{:.2g}", std::floor(value / unit * (1 + 1e-5)) * unit);
}

/// Warns about closed shells inside others that do not make cavities.
void warnOfFilled(const Context& c, const SolidFigures& figures) {
    const bool one = figures.filledShells == 1;
    if (figures.filledShells > 0)
        c.warn(
            fmt::format("{} closed {} inside the solid {} filled, not hollow, since {} faces point outward like those "
                        "of the shell around {}: {} faces, volume {:.3g}; flip those faces if {} should be {}",
                        figures.filledShells, one ? "shell" : "shells", one ? "is" : "are", one ? "its" : "their",
                        one ? "it" : "them", figures.filledFaces, figures.filledVolume, one ? "it" : "they",
                        one ? "a cavity" : "cavities"));
}

/// Warns about parts that are too thin for the voxels.
void warnOfThinParts(const Context& c, const SolidFigures& figures, double voxel) {
    constexpr double kWorthAWarning = 0.005, kFolds = 1.0 / 16; // of a voxel
    if (!(figures.thin > kWorthAWarning)) return;
    const std::string missing =
        figures.missing > kWorthAWarning
            ? fmt::format(", {:.1f} % to parts thinner than one voxel, which the level set may lack",
                          100 * figures.missing)
            : "";
    const std::string enough = roundedDown(std::min(figures.enough, voxel));
    const std::string folds =
        figures.enough < kFolds * voxel ? " for the thinnest, but folds of a noisy scan need no smaller voxels" : "";
    c.warn(
        fmt::format("thin parts: {:.1f} % of the surface belongs to parts thinner than {} voxels, where the level set "
                    "may be off by more than half a voxel and films may have gaps{}; voxel={} is enough{}",
                    100 * figures.thin, kThinVoxels, missing, enough, folds));
}

void warnOfSolid(const Context& c, const SolidFigures& figures, double voxel) {
    if (figures.undecided > 0.5)
        c.warn(
            fmt::format("sheets in the mesh are no obstacles: {:.0f} % of the voxels next to it are neither inside nor "
                        "outside; thickness={:.3g} makes all faces obstacles four voxels thick",
                        100 * figures.undecided, 4 * voxel));
    else if (figures.boundaryEdges > 0 && figures.meanThickness > 0 && figures.meanThickness < 2)
        c.warn(fmt::format(
            "the volume that the mesh encloses is only {:.1f} voxels thick on average; if it should be thicker, close "
            "the holes of the mesh or flip its faces; otherwise use smaller voxels or thickness={:.3g}",
            figures.meanThickness, 4 * voxel));
    warnOfFilled(c, figures);
    warnOfThinParts(c, figures, voxel);
}

/// Warns, once, if dim= gives voxels of different sizes in different frames.
void warnOfChangingVoxels(const Context& c, const Arguments& a, double voxel) {
    constexpr double kChange = 0.01;
    // Other frames are evaluated too, silently, to find out how a wall moves.
    if (!c.clock() || a.given("voxel") || c.moment().time != c.clock()->time) return;
    auto first = std::static_pointer_cast<double>(c.memory().object);
    if (!first) c.memory().object = first = std::make_shared<double>(voxel);
    if (!(std::abs(voxel / *first - 1) > kChange)) return;
    c.warn(
        fmt::format("dim= gives voxels of {:.3g} in this frame, {:.3g} in the first, since it is relative to the "
                    "mesh's box, so the surface may flicker; voxel={:.2g} gives all frames the same",
                    voxel, *first, *first));
    *first = std::numeric_limits<double>::quiet_NaN(); // said
}

void meshToLevelSetAction(Context& c, const Arguments& a) {
    const double thickness = a.given("thickness") ? a.real("thickness") : 0;
    auto dim = a.integer<int>("dim");
    if (const int most = mostVoxels(*c.mesh("mesh")); most < dim && !a.given("dim") && !a.given("voxel")) {
        c.warn(
            fmt::format("the mesh is so small that its longest edge has {} voxels instead of {}, since OpenVDB takes "
                        "none below 1.5e-5; scale the scene up for more detail",
                        most, dim));
        dim = most;
    }
    const auto [levelSet, figures] = solidOf(c.mesh("mesh"),
                                             {.voxel = a.given("voxel") ? a.real("voxel") : 0,
                                              .dim = dim,
                                              .halfWidth = a.real("halfWidth"),
                                              .thickness = thickness},
                                             c.follow("mesh to level set"));
    c.info(fmt::format("level set: {} voxels of {:.6g}", levelSet.grid->activeVoxelCount(), levelSet.voxelSize()));
    if (const std::string description = descriptionOf(figures); thickness == 0 && !description.empty())
        c.info("mesh: " + description);
    if (thickness > 0 && thickness < 2 * levelSet.voxelSize())
        c.warn(fmt::format(
            "thickness {:.3g} is less than two voxels of {:.3g}, so the sheet may have gaps; use smaller voxels",
            thickness, levelSet.voxelSize()));
    warnOfSolid(c, figures, levelSet.voxelSize());
    warnOfChangingVoxels(c, a, levelSet.voxelSize());
    c.report("mesh2ls") = {{"voxels", levelSet.grid->activeVoxelCount()},
                           {"boundary_edges", figures.boundaryEdges},
                           {"duplicate_faces", figures.duplicateFaces},
                           {"degenerate_faces", figures.degenerateFaces},
                           {"reversed_faces", figures.reversedFaces},
                           {"turned_shells", figures.turnedShells},
                           {"clean", figures.clean},
                           {"turned", figures.turned},
                           {"undecided", figures.undecided},
                           {"hidden", figures.hidden},
                           {"filled_shells", figures.filledShells},
                           {"filled_faces", figures.filledFaces},
                           {"filled_volume", figures.filledVolume},
                           {"thin", figures.thin},
                           {"missing", figures.missing},
                           {"voxel_enough", figures.enough},
                           {"mean_thickness_voxels", figures.meanThickness}};
    c.give(GridValue{levelSet.grid, levelSet.mesh});
}

/// Warns, once and not in every frame, if the voxels are too large for the flow.
void warnOfCoarseVoxels(const Context& c, const Flow& flow, double voxel) {
    if (std::exchange(c.memory().object, std::make_shared<bool>(true))) return;
    const double wavelength = wavelengthOf(flow, c.follow("measuring the flow's wavelength")),
                 voxels = wavelength / voxel;
    if (!(wavelength > 0) || voxels >= kVoxelsPerWavelength) return;
    // Rounded down: 3.96 voxels are not 4.
    c.warn(
        fmt::format("the flow's wavelength of {:.3g} spans only {:.1f} voxels, fewer than {}, so details are lost; "
                    "voxel={} is enough, or use a lower frequency or fewer octaves",
                    wavelength, std::floor(10 * voxels) / 10, kVoxelsPerWavelength,
                    roundedDown(wavelength / kVoxelsPerWavelength)));
}

/// Returns the current velocity of the flow's wall: from its motion since the previous frame or, in the first frame, to
/// the next one.
std::optional<WallVelocity> movingWall(const Context& c) {
    double interval = 1 / c.moment().fps;
    if (c.clock()) {
        interval *= framePlanOf(*c.graph().frameRange).by;
        if (c.clock()->duration > 0) interval = -c.clock()->duration;
    }
    return wallVelocity(c.flowInTime("flow"), c.moment().time, interval);
}

/// Returns the velocity of the air that the wall displaces, as a potential flow.
openvdb::Vec3SGrid::ConstPtr displacedBy(Context& c, const Flow& flow, const VelocityGridOptions& options) {
    const DisplacedAir air =
        displacedAir(flow.domain(), *options.moving, {.voxels = voxelsOf(flow, options)}, c.follow("displaced air"));
    c.report("displaced") = {{"voxels", air.voxels}, {"iterations", air.iterations}};
    return air.faces;
}

std::string motionOf(const std::optional<WallVelocity>& moving, bool potential) {
    if (!moving) return "";
    if (potential) return ", including the potential flow around the moving wall";
    return moving->rigid() ? ", including the velocity of the moving wall"
                           : ", including the velocity of the deforming wall, which is not divergence-free";
}

/// Returns the box without its upper sides, on which the voxels of its lower sides repeat. Throws ValueError if the box
/// does not hold whole voxels.
Box tileOf(const Box& box, double voxel) {
    constexpr double kTolerance = 1e-6; // voxels
    Box tile = box;
    for (int axis = 0; axis < 3; ++axis) {
        for (const double side : {box.lower[axis], box.upper[axis]})
            if (std::abs(side / voxel - std::round(side / voxel)) > kTolerance)
                throw ValueError(
                    fmt::format("tile=1 needs a box of whole voxels, but {} along {} is {:.6g} voxels of "
                                "{:.6g}; change box=, voxel= or dim=",
                                side, "xyz"[axis], side / voxel, voxel));
        tile.upper[axis] -= 0.5 * voxel;
    }
    return tile;
}

/// Warns if the velocities on opposite sides of the box differ, so that copies of the grid have seams.
void warnOfSeams(const Context& c, const Flow& flow, const Box& box) {
    if (c.clock() && c.clock()->duration > 0) return; // said in the first frame
    constexpr uint64_t kSamples = 256, kSeed = 0x7365616d;
    constexpr double kTolerance = 1e-5; // of the rms speed
    const double speed = rmsOf(flow).speed;
    const auto& wall = flow.domain().wall; // beyond it, the grid is zero
    const auto velocityAt = [&](const Vec3d& p) {
        const bool flows = !wall || beyondWall(wall->side, wall->sdf.distance.at<0>(p).value) < 0;
        return flows ? flow.at(p).velocity : Vec3d{};
    };
    for (int axis = 0; axis < 3; ++axis) {
        double most = 0;
        for (uint64_t k = 0; k < kSamples; ++k) {
            Vec3d p;
            for (int i = 0; i < 3; ++i)
                p[i] = box.lower[i] + box.size()[i] * randomUniform(kSeed, k, static_cast<uint64_t>(i));
            Vec3d q = p;
            p[axis] = box.lower[axis], q[axis] = box.upper[axis];
            most = std::max(most, length(velocityAt(p) - velocityAt(q)));
        }
        if (most > kTolerance * speed)
            c.warn(
                fmt::format("the grid does not tile along {}: velocities on opposite sides differ by up to {:.2g} "
                            "times the rms speed; give the noises a period= that divides the box",
                            "xyz"[axis], most / speed));
    }
}

void velocity(Context& c, const Arguments& a) {
    Flow flow = c.flow("flow");
    Domain domain = flow.domain();
    if (a.given("padding") && domain.wall) domain = Domain::of(*domain.wall, a.real("padding"));
    if (a.given("box")) domain.box = a.box("box");
    flow = flow.within(domain);
    warnOfMovingWall(c, c.flowInTime("flow"), "velocities beside it may be wrong", false);
    VelocityGridOptions options{.voxel = a.given("voxel") ? a.real("voxel") : 0,
                                .dim = a.integer<int>("dim"),
                                .layout = a.flag("staggered") ? Layout::staggered : Layout::collocated,
                                .mask = c.has("mask") ? c.grid("mask").grid : nullptr,
                                .wallFade = a.real("wallFade"),
                                .moving = movingWall(c),
                                .source = velocitySourceOf(c, a, a.flag("staggered"))};
    if (a.flag("tile")) {
        if (options.mask) throw ValueError("tile=1 has no effect with a mask");
        options.voxel = voxelsOf(flow, options).size;
        warnOfSeams(c, flow, domain.box);
        domain.box = tileOf(domain.box, options.voxel);
        flow = flow.within(domain);
    }
    const bool potential = options.moving && a.text("displaced") == "potential";
    for (const char* name : {"dim", "voxel", "box", "padding"})
        if (const bool ofAir = potential && (name == std::string_view("box") || name == std::string_view("padding"));
            options.mask && a.given(name) && !ofAir)
            throw ValueError(fmt::format("{}= has no effect with a mask, whose voxels the grid has", name));
    if (potential)
        options.displaced = displacedBy(c, flow, options);
    else if (options.moving)
        warnOfFastAir(c, *options.moving, flow.domain());
    const auto grid = velocityGrid(flow, options, c.follow("velocity"));
    if (grid->activeVoxelCount() == 0)
        throw ValueError("the grid has no active voxel, since the domain is thinner than a voxel; use smaller voxels");
    grid->setName(a.text("name"));
    c.info(fmt::format("velocity: {} active voxels of {:.6g}{}", grid->activeVoxelCount(), grid->voxelSize()[0],
                       motionOf(options.moving, potential)));
    if (c.used("velocity")) warnOfCoarseVoxels(c, flow, grid->voxelSize()[0]);
    const auto give = [&](const openvdb::GridBase::Ptr& made) {
        made->setSaveFloatAsHalf(a.flag("half"));
        made->setCreator("Curlew");
        c.give(GridValue{made});
    };
    if (a.flag("potentials")) {
        if (!flow.hasTracks())
            throw ValueError("potentials=1 needs a flow with tracks; sums and velocity grids have none");
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
         .group = kGridGroup,
         .summary = "convert a mesh to a level set (narrow-band SDF), even if it is open, overlapping or broken",
         .takes = {taken("mesh", {Kind::mesh}, "geo")},
         .makes = {made("levelSet", {Kind::levelSet})},
         .options = {integer("dim", textOf(SolidOptions{}.dim), 1, 1e6,
                             "number of voxels along the longest edge of the mesh's box"),
                     instead(positive("voxel", "", "world units", "voxel size (default: from dim=)"), {"dim"}),
                     {.name = "halfWidth",
                      .type = OptionType::real,
                      .fallback = textOf(SolidOptions{}.halfWidth),
                      .help = "half width of the narrow band; -bound widens it if necessary",
                      .unit = "voxels",
                      .lower = 1,
                      .upper = 1000,
                      .formerly = {"width"}},
                     positive("thickness", "", "world units",
                              "thickness of a sheet such as cloth or terrain, half on either side (default: a solid; "
                              "holes are closed)"),
                     ages("geo", "", "mesh to convert: 0 is the newest geometry (default: the newest mesh)"),
                     keep()},
         .examples = {"curlew -read bunny.obj -mesh2ls voxel=0.01 -write bunny.vdb"},
         .run = meshToLevelSetAction},
        {.name = "velocity",
         .group = kGridGroup,
         .summary = "sample the newest flow on a sparse velocity grid (OpenVDB)",
         .takes = {stays("flow", {Kind::flow}), onRequest(stays("mask", {Kind::grid}, "mask"), "only with mask=",
                                                          [](const Arguments& given) { return given.given("mask"); })},
         .makes = {made("g", {Kind::grid}, "potentials"), made("f", {Kind::grid}, "potentials"),
                   made("density", {Kind::grid}, "density"), made("velocity", {Kind::velocity})},
         .options =
             {integer("dim", textOf(VelocityGridOptions{}.dim), 1, 1e6,
                      "number of voxels along the longest edge of the domain's box"),
              instead(positive("voxel", "", "world units", "voxel size (default: from dim=)"), {"dim"}),
              flag("staggered", "0",
                   "1: staggered (MAC) grid, components on voxel faces, divergence-free up to rounding errors; "
                   "for solvers. 0: at voxel centres; for Blender, RenderMan and most others"),
              text("name", "vel", "name of the grid; applications look for vel, v or velocity"),
              flag("half", "0", "1: store 16-bit floats"),
              box("box", "region to sample (default: the domain of the flow)"),
              flag("tile", "0",
                   "1: for a box that is a period of the flow (-noise period=): leave out the voxels on the upper "
                   "sides of the box, which equal those on its lower sides, so that copies of the grid join without "
                   "a seam"),
              notNegative("padding", "", "world units",
                          "distance to sample beyond an obstacle (default: the domain of the flow)"),
              ages("mask", "",
                   "grid whose active voxels, and no others, are sampled, at its resolution: 0 is the newest"),
              {.name = "wallFade",
               .type = OptionType::real,
               .fallback = textOf(VelocityGridOptions{}.wallFade),
               .help = "width of the layer beyond the wall in which the velocity fades to zero",
               .unit = "voxels",
               .lower = 1,
               .upper = 100,
               .formerly = {"skin"}},
              choice("displaced", {"fade", "potential"},
                     "air that a moving wall pushes away; fade: it moves with the wall and ends with the layer. "
                     "potential: the potential flow around an obstacle, as far as the box, which is "
                     "divergence-free for a wall that deforms too, but slower: each frame solves a Poisson equation"),
              flag("density", "0", "1: also make a fog volume 'density' of the domain"),
              flag("potentials", "0", "1: also make grids 'f' and 'g' of the potentials"),
              deviceOption()},
         .examples =
             {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn speed=1 -velocity "
              "voxel=0.02 density=1 -write grid=0,1 smoke.vdb",
              "curlew -noise frequency=2 period=4 -noise frequency=2 period=4 seed=1 -dfvn -velocity tile=1 dim=64 "
              "box=0,0,0,2,2,2 -write tile.vdb"},
         .run = velocity}};
}

} // namespace curlew::app
