// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "TrackOptions.h"
#include "curlew/flow/Flows.h"
#include "curlew/vdb/GridAdvection.h"
#include "curlew/vdb/LevelSetAdvection.h"
#include "curlew/vdb/LevelSetMesh.h"

#include <openvdb/tools/LevelSetMeasure.h>

namespace curlew::app {

namespace {

using namespace options;

const std::string kGroup = "following the flow";

/// The equal steps of a scheme that does not estimate its error, and how often a flow that changes is frozen, if
/// nothing is said.
constexpr int kParts = 100;

struct FollowOptions {
    int steps = 0;
    std::optional<Scheme> scheme;
    double accuracy = 0;
    ReprojectionOptions reprojection;
};

const Binding<FollowOptions>& followBinding() {
    static const auto binding =
        stepBinding<FollowOptions>(
            "so many time steps of equal length, instead of those that accuracy= asks for. With both, accuracy= rules, "
            "and this is how often a flow that changes is frozen (default: 100 times; after -frames, from frame to "
            "frame, its substeps)",
            "the flow is followed by steps whose estimated error is at most this (default: a thousandth of a voxel, "
            "unless steps= is given)")
            .include(
                solverBinding({}, "voxel waits"), [](auto& o) -> auto& { return o.reprojection; });
    return binding;
}

/// Whether the way is that from the first frame to this one.
bool byFrame(const Context& c, const Arguments& a) { return c.clock() && !a.given("time"); }
double timeOf(const Context& c, const Arguments& a) { return byFrame(c, a) ? c.clock()->time : a.real("time"); }

FlowMapOptions mapOptions(const Context& c, const Arguments& a, double voxelSize) {
    const FollowOptions given = followBinding().read(a);
    FlowMapOptions options{.scheme = given.scheme, .reprojection = given.reprojection, .accuracy = given.accuracy};
    const double time = std::abs(byFrame(c, a) ? c.clock()->duration : a.real("time"));
    if (!a.given("steps") && !asksForEqualSteps(a, given.scheme)) options = forVoxels(options, voxelSize);
    const int parts = a.given("steps") ? given.steps : byFrame(c, a) ? c.clock()->substeps : kParts;
    if (time > 0) options.step = time / parts;
    return options;
}

LevelSet levelSetOf(const Context& c) {
    const GridValue& value = c.grid("levelSet");
    LevelSet levelSet = curlew::levelSetOf(value.grid);
    levelSet.mesh = value.mesh;
    return levelSet;
}

double horizonOf(const Arguments& a) {
    return a.given("restart") ? a.real("restart") : std::numeric_limits<double>::infinity();
}

double volumeOf(const LevelSet& levelSet) { return openvdb::tools::levelSetVolume(*levelSet.grid); }

/// The level set in this frame. What comes before is kept from frame to frame; after -resume it is made again, through
/// the same moments, so that the same comes out.
AdvectedLevelSet advanced(Context& c, const Arguments& a, const LevelSet& original, const Monitor& monitor) {
    const FrameClock& clock = *c.clock();
    if (clock.duration == 0) return {.levelSet = original}; // the first one
    auto sequence = std::static_pointer_cast<LevelSetSequence>(c.memory().object);
    if (!sequence)
        sequence = std::make_shared<LevelSetSequence>(
            original, c.flowInTime("flow"), 0,
            LevelSetSequenceOptions{.map = mapOptions(c, a, original.voxelSize()), .horizon = horizonOf(a)}, monitor);
    c.memory().object = sequence;
    const double by = std::round(clock.duration * clock.fps);
    AdvectedLevelSet result;
    for (double k = std::round(sequence->time() * clock.fps / by) + 1; k * by / clock.fps <= clock.time; ++k)
        result = sequence->advance(k * by / clock.fps, monitor);
    return result;
}

void advectLevelSetAction(Context& c, const Arguments& a) {
    const LevelSet before = levelSetOf(c);
    const Monitor monitor = c.follow("following the level set");
    const double begin = a.real("begin"), time = timeOf(c, a);
    const bool weno5 = a.text("method") == "weno5";
    AdvectedLevelSet result;
    if (weno5)
        result.levelSet = advectLevelSetWeno5(before, c.flowInTime("flow"), begin, time, monitor);
    else if (byFrame(c, a))
        result = advanced(c, a, before, monitor);
    else
        result =
            advectLevelSet(before, c.flowInTime("flow"), begin, time, mapOptions(c, a, before.voxelSize()), monitor);
    const double change = volumeOf(result.levelSet) / volumeOf(before) - 1;
    c.say(
        fmt::format("level set: {} voxels, volume {:+.3g} %", result.levelSet.grid->activeVoxelCount(), 100 * change));
    auto& report = c.report("advect_level_set") = {{"voxels", result.levelSet.grid->activeVoxelCount()},
                                                   {"volume_change", change}};
    if (!weno5) {
        report["traced"] = result.traced;
        report["kept_back"] = result.kept;
        report["unsettled"] = result.unsettled;
        report["surface_shift_mean"] = result.meanShift;
        report["surface_shift_max"] = result.greatestShift;
    }
    if (result.kept > 0)
        c.warn(fmt::format("{} of {} voxels found no way back on their tracks; give a finer accuracy= or more steps=",
                           result.kept, result.traced));
    c.give(GridValue{result.levelSet.grid});
}

void advectGridAction(Context& c, const Arguments& a) {
    const openvdb::GridBase::ConstPtr grid = c.grid("grid").grid;
    const AdvectedGrid result = advectGrid(
        *grid, c.flowInTime("flow"), a.real("begin"), timeOf(c, a),
        {.map = mapOptions(c, a, grid->voxelSize()[0]), .interpolation = a.choice<Interpolation>("interpolation")},
        c.follow("following the grid"));
    c.say(fmt::format("grid '{}': {} active voxels", grid->getName(), result.grid->activeVoxelCount()));
    c.report("advect_grid") = {
        {"voxels", result.grid->activeVoxelCount()}, {"traced", result.traced}, {"kept_back", result.kept}};
    c.give(GridValue{result.grid});
}

void levelSetToMeshAction(Context& c, const Arguments& a) {
    auto mesh = std::make_shared<const Mesh>(levelSetToMesh(levelSetOf(c), a.real("adaptivity")));
    c.say(fmt::format("mesh: {} points, {} faces", mesh->points.size(), mesh->faces()));
    c.give(std::move(mesh));
}

/// What following needs, and `own` options before the rest.
std::vector<Option> followOptions(std::vector<Option> own) {
    std::vector<Option> options{
        real("time", "1", "s",
             "how long; negative follows the flow backward; after -frames the default is from the first frame to this"),
        real("begin", "0", "s", "the time at which it begins; it matters in flows that change")};
    options.insert(options.end(), followBinding().options().begin(), followBinding().options().end());
    options.insert(options.begin() + 1, own.begin(), own.end());
    return options;
}

} // namespace

Registry levelSetActions() {
    return {{.name = "advectLevelSet",
             .group = kGroup,
             .summary = "move the newest level set along the newest flow, without diffusing it",
             .takes = {stays("flow", {Kind::flow}), taken("levelSet", {Kind::levelSet}, "grid")},
             .makes = {made("levelSet", {Kind::levelSet})},
             .options = followOptions(
                 {choice("method", {"flowmap", "weno5"},
                         "look up where the flow has been, in one step whatever the time; or OpenVDB's advection, to "
                         "compare with (it chooses its own steps)"),
                  positive("restart", "", "s",
                           "after -frames: begin anew from the level set of that moment after so long, which bounds "
                           "the time that a frame takes, and costs accuracy (default: never)"),
                  ages("grid", "", "which level set (default: the newest)"), keep()}),
             .examples = {"curlew -read bunny.obj -mesh2ls -noise frequency=2 -noise frequency=2 seed=1 -dfvn speed=1 "
                          "-advectLevelSet time=0.5 -write moved.vdb"},
             .inFrames = InFrames::each,
             .run = advectLevelSetAction},
            {.name = "advectGrid",
             .group = kGroup,
             .summary = "move a fog volume, or another grid of numbers or vectors, along the newest flow",
             .takes = {stays("flow", {Kind::flow}), taken("grid", {Kind::grid}, "grid")},
             .makes = {made("grid", {Kind::grid})},
             .options = followOptions({choice("interpolation", {"linear", "quadratic"},
                                              "between voxels; quadratic is sharper, but may overshoot"),
                                       ages("grid", "0", "which grid"), keep()}),
             .examples = {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn speed=1 -read "
                          "smoke.vdb grids=density -advectGrid time=0.5 -write moved.vdb"},
             .inFrames = InFrames::each,
             .run = advectGridAction,
             .makesWith =
                 [](const Arguments&, const std::vector<std::vector<Object>>& inputs, const World&) {
                     Object moved = inputs[1].empty() ? Object{.kind = Kind::grid} : inputs[1].front();
                     moved.name = "grid";
                     return std::vector{moved};
                 }},
            {.name = "ls2mesh",
             .group = kGroup,
             .summary = "turn a level set into a mesh",
             .takes = {taken("levelSet", {Kind::levelSet}, "grid")},
             .makes = {made("mesh", {Kind::mesh})},
             .options = {{.name = "adaptivity",
                          .type = OptionType::real,
                          .fallback = "0",
                          .help = "larger faces where the surface is flat; 0 gives quads of a voxel's size",
                          .lower = 0,
                          .upper = 1},
                         ages("grid", "", "which level set (default: the newest)"),
                         keep()},
             .examples = {"curlew -read bunny.vdb -ls2mesh -write bunny.ply"},
             .run = levelSetToMeshAction}};
}

} // namespace curlew::app
