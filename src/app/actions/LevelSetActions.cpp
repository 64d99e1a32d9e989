// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "MovingWall.h"
#include "TrackOptions.h"
#include "curlew/flow/Flows.h"
#include "curlew/vdb/GridAdvection.h"
#include "curlew/vdb/LevelSetAdvection.h"
#include "curlew/vdb/LevelSetMesh.h"
#include "curlew/vdb/LevelSetVolume.h"
#include "curlew/vdb/Openvdb.h"

namespace curlew::app {

namespace {

using namespace options;

const std::string kLevelSetGroup = "following the flow";

/// The default number of equal steps of a scheme without error estimate, and of frozen intervals of a flow that changes
/// with time.
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
            "number of equal time steps, instead of steps chosen by accuracy=. With both, accuracy= chooses the steps, "
            "and this is the number of intervals in which a time-dependent flow is held constant (default: 100; after "
            "-frames, its substeps per frame)",
            "maximum estimated error of a step along the flow (default: 1/1000 of a voxel, unless steps= or a scheme "
            "without error estimate is given)")
            .include(
                solverBinding({}, "position traced from a voxel stays where it is"),
                [](auto& o) -> auto& { return o.reprojection; });
    return binding;
}

/// Returns whether the level set is advected from the first frame to this one.
bool byFrame(const Context& c, const Arguments& a) { return c.clock() && !a.given("duration"); }
double timeOf(const Context& c, const Arguments& a) { return byFrame(c, a) ? c.clock()->time : a.real("duration"); }

FlowMapOptions mapOptions(const Context& c, const Arguments& a, double voxelSize) {
    const FollowOptions given = followBinding().read(a);
    FlowMapOptions options{.scheme = given.scheme, .reprojection = given.reprojection, .accuracy = given.accuracy};
    const double time = std::abs(byFrame(c, a) ? c.clock()->duration : a.real("duration"));
    if (!a.given("steps") && !asksForEqualSteps(a, given.scheme)) options = forVoxels(options, voxelSize);
    const int parts = a.given("steps") ? given.steps : byFrame(c, a) ? c.clock()->substeps : kParts;
    if (time > 0) options.step = time / parts;
    return options;
}

LevelSet levelSetToFollow(const Context& c) {
    const GridValue& value = c.grid("levelSet");
    LevelSet levelSet = levelSetOf(value.grid);
    levelSet.mesh = value.mesh;
    return levelSet;
}

double horizonOf(const Arguments& a) {
    return a.given("restart") ? a.real("restart") : std::numeric_limits<double>::infinity();
}

/// Warns if voxels could not be traced back, or if a moving wall left some on its wrong side.
void warnOfTraces(const Context& c, size_t kept, size_t overrun, size_t traced) {
    if (kept > 0)
        c.warn(fmt::format(
            "{} of {} voxels could not be traced back along their tracks; use a finer accuracy= or more steps=", kept,
            traced));
    if (overrun > 0)
        c.warn(fmt::format("a moving wall passed over {} of {} traced voxels; use more steps=", overrun, traced));
}

constexpr std::string_view kMixedSides = "matter may end up on the wrong side";

/// Returns the level set in this frame. The state is kept from frame to frame. After -resume, it is recomputed through
/// the same moments, so that the result is identical.
AdvectedLevelSet advanced(Context& c, const Arguments& a, const LevelSet& original, const Monitor& monitor) {
    const FrameClock& clock = *c.clock();
    if (clock.duration == 0) return {.levelSet = original}; // the first frame
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
    const LevelSet before = levelSetToFollow(c);
    warnOfMovingWall(c, c.flowInTime("flow"), kMixedSides);
    const Monitor monitor = c.follow("advecting the level set");
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
    const Monitor measuring = c.follow("measuring the volume");
    const double change = volumeOf(result.levelSet, measuring.quiet()) / volumeOf(before, measuring.quiet()) - 1;
    c.info(
        fmt::format("level set: {} voxels, volume {:+.3g} %", result.levelSet.grid->activeVoxelCount(), 100 * change));
    auto& report = c.report("advect_level_set") = {{"voxels", result.levelSet.grid->activeVoxelCount()},
                                                   {"volume_change", change}};
    if (!weno5) {
        report["traced"] = result.traced;
        report["stalled"] = result.stalled;
        report["overrun"] = result.overrun;
        report["unconverged"] = result.unconverged;
        report["surface_shift_mean"] = result.meanShift;
        report["surface_shift_max"] = result.greatestShift;
    }
    warnOfTraces(c, result.stalled, result.overrun, result.traced);
    c.give(GridValue{result.levelSet.grid});
}

void advectGridAction(Context& c, const Arguments& a) {
    const openvdb::GridBase::ConstPtr grid = c.grid("grid").grid;
    warnOfMovingWall(c, c.flowInTime("flow"), kMixedSides);
    const AdvectedGrid result = advectGrid(
        *grid, c.flowInTime("flow"), a.real("begin"), timeOf(c, a),
        {.map = mapOptions(c, a, grid->voxelSize()[0]), .interpolation = a.choice<Interpolation>("interpolation")},
        c.follow("advecting the grid"));
    c.info(fmt::format("grid '{}': {} active voxels", grid->getName(), result.grid->activeVoxelCount()));
    c.report("advect_grid") = {{"voxels", result.grid->activeVoxelCount()},
                               {"traced", result.traced},
                               {"stalled", result.stalled},
                               {"overrun", result.overrun}};
    warnOfTraces(c, result.stalled, result.overrun, result.traced);
    c.give(GridValue{result.grid});
}

void levelSetToMeshAction(Context& c, const Arguments& a) {
    auto mesh = std::make_shared<const Mesh>(levelSetToMesh(levelSetToFollow(c), a.real("adaptivity")));
    c.info(fmt::format("mesh: {} points, {} faces", mesh->points.size(), mesh->faces()));
    c.give(std::move(mesh));
}

/// Returns the options for advection, with `own` inserted after duration=. `follows`: conditions of Option::onlyWith
/// for those of followBinding().
std::vector<Option> followOptions(std::vector<Option> own, const std::vector<std::string>& follows = {}) {
    std::vector<Option> options{
        formerly(
            {"time"},
            real("duration", "1", "s",
                 "advection time; negative runs backward. After -frames, without duration=: since the first frame")),
        real("begin", "0", "s", "start time; it matters only in time-dependent flows")};
    for (const Option& option : followBinding().options()) options.push_back(onlyWith(follows, option));
    options.insert(options.begin() + 1, own.begin(), own.end());
    return options;
}

} // namespace

Registry levelSetActions() {
    return {
        {.name = "advectLevelSet",
         .group = kLevelSetGroup,
         .summary =
             "advect the newest level set along the newest flow, without numerical diffusion; moving walls push it",
         .takes = {stays("flow", {Kind::flow}), taken("levelSet", {Kind::levelSet}, "grid")},
         .makes = {made("levelSet", {Kind::levelSet})},
         .options = followOptions(
             {choice("method", {"flowmap", "weno5"},
                     "flowmap: trace back along the flow, in one step for any time; weno5: OpenVDB's level set "
                     "advection, for comparison (it chooses its own steps)"),
              onlyWith({"method=flowmap"},
                       positive("restart", "", "s",
                                "after -frames: interval after which the advection starts again from the level set at "
                                "that time, which limits the time per frame but costs accuracy (default: never)")),
              ages("grid", "", "level set to advect: 0 is the newest grid (default: the newest level set)"), keep()},
             {"method=flowmap"}),
         .examples = {"curlew -read bunny.obj -mesh2ls -noise frequency=2 -noise frequency=2 seed=1 -dfvn speed=1 "
                      "-advectLevelSet duration=0.5 -write moved.vdb"},
         .inFrames = InFrames::each,
         .run = advectLevelSetAction},
        {.name = "advectGrid",
         .group = kLevelSetGroup,
         .summary =
             "advect a fog volume, or another scalar or vector grid, along the newest flow; moving walls push it",
         .takes = {stays("flow", {Kind::flow}), taken("grid", {Kind::grid}, "grid")},
         .makes = {made("grid", {Kind::grid})},
         .options = followOptions({choice("interpolation", {"linear", "quadratic"},
                                          "interpolation between voxels; quadratic is sharper but may overshoot"),
                                   ages("grid", "0", "grid to advect: 0 is the newest"), keep()}),
         .examples = {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn speed=1 -read "
                      "smoke.vdb grids=density -advectGrid duration=0.5 -write moved.vdb"},
         .inFrames = InFrames::each,
         .run = advectGridAction,
         .makesWith =
             [](const Arguments&, const std::vector<std::vector<Object>>& inputs, const World&) {
                 Object moved = inputs[1].empty() ? Object{.kind = Kind::grid} : inputs[1].front();
                 moved.name = "grid";
                 return std::vector{moved};
             }},
        {.name = "ls2mesh",
         .group = kLevelSetGroup,
         .summary = "convert a level set to a mesh (isosurface polygons)",
         .takes = {taken("levelSet", {Kind::levelSet}, "grid")},
         .makes = {made("mesh", {Kind::mesh})},
         .options = {{.name = "adaptivity",
                      .type = OptionType::real,
                      .fallback = "0",
                      .help = "mesh simplification where the surface is flat, 0 to 1; 0: quads of the size of a voxel",
                      .lower = 0,
                      .upper = 1},
                     ages("grid", "", "level set to convert: 0 is the newest grid (default: the newest level set)"),
                     keep()},
         .examples = {"curlew -read bunny.vdb -ls2mesh -write bunny.ply"},
         .run = levelSetToMeshAction}};
}

} // namespace curlew::app
