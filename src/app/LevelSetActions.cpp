#include "Options.h"
#include "curlew/app/Registry.h"
#include "curlew/app/Session.h"
#include "curlew/flow/Flows.h"
#include "curlew/vdb/GridAdvection.h"
#include "curlew/vdb/LevelSetAdvection.h"
#include "curlew/vdb/LevelSetMesh.h"

#include <openvdb/tools/LevelSetMeasure.h>

namespace curlew::app {

namespace {

using namespace options;

const std::string kGroup = "following the flow";

FlowInTime flowFor(Session& s, const Arguments& a) {
    return a.text("flow") == "enright" ? enrightFlowInTime(a.real("period")) : s.flowInTime();
}

/// Whether the way is that from the first frame to this one.
bool byFrame(const Session& s, const Arguments& a) { return s.clock && !a.given("time"); }
double timeOf(const Session& s, const Arguments& a) { return byFrame(s, a) ? s.clock->time : a.real("time"); }

FlowMapOptions mapOptions(const Session& s, const Arguments& a) {
    const double time = std::abs(byFrame(s, a) ? s.clock->duration : a.real("time"));
    const int64_t steps = byFrame(s, a) && !a.given("steps") ? s.clock->substeps : a.integer("steps");
    FlowMapOptions options{.scheme = static_cast<Scheme>(a.choice("scheme")),
                           .reprojection = {.tolerance = a.real("tolerance"),
                                            .iterations = static_cast<int>(a.integer("iterations")),
                                            .maxSubdivisions = static_cast<int>(a.integer("halvings"))}};
    if (time > 0) options.step = time / static_cast<double>(steps);
    return options;
}

/// The level set of the option grid=, or the newest.
size_t levelSetAge(const Session& s, const Arguments& a) {
    if (a.given("grid")) return a.ages("grid").front();
    const auto age = s.newestLevelSet();
    if (!age) throw ValueError("there is no level set; make one with -mesh2ls, or read one");
    return *age;
}

LevelSet levelSetAt(const Session& s, size_t age) {
    const GridObject& object = s.grids.at(age);
    LevelSet levelSet = levelSetOf(object.grid);
    levelSet.mesh = object.mesh;
    return levelSet;
}

double horizonOf(const Arguments& a) {
    return a.given("restart") ? a.real("restart") : std::numeric_limits<double>::infinity();
}

double volumeOf(const LevelSet& levelSet) { return openvdb::tools::levelSetVolume(*levelSet.grid); }

/// The level set in this frame. What comes before is kept from frame to frame; after -resume it is made again, through
/// the same moments, so that the same comes out.
AdvectedLevelSet advanced(Session& s, const Arguments& a, const LevelSet& original, const FlowInTime& flow,
                          const Monitor& monitor) {
    const FrameClock& clock = *s.clock;
    if (clock.duration == 0) return {.levelSet = original}; // the first one
    auto& sequence = s.sequences[s.recorded()];
    if (!sequence)
        sequence = std::make_shared<LevelSetSequence>(
            original, flow, 0, LevelSetSequenceOptions{.map = mapOptions(s, a), .horizon = horizonOf(a)}, monitor);
    const double by = std::round(clock.duration * clock.fps);
    AdvectedLevelSet result;
    for (double k = std::round(sequence->time() * clock.fps / by) + 1; k * by / clock.fps <= clock.time; ++k)
        result = sequence->advance(k * by / clock.fps, monitor);
    return result;
}

void advectLevelSetAction(Session& s, const Arguments& a) {
    const size_t age = levelSetAge(s, a);
    const LevelSet before = levelSetAt(s, age);
    const FlowInTime flow = flowFor(s, a);
    const Monitor monitor = s.console.follow("following the level set");
    const double begin = a.real("begin"), time = timeOf(s, a);
    AdvectedLevelSet result;
    if (a.text("method") == "weno5")
        result.levelSet = advectLevelSetWeno5(before, flow, begin, time, monitor);
    else if (byFrame(s, a))
        result = advanced(s, a, before, flow, monitor);
    else
        result = advectLevelSet(before, flow, begin, time, mapOptions(s, a), monitor);
    const double change = volumeOf(result.levelSet) / volumeOf(before) - 1;
    s.console.say(
        fmt::format("level set: {} voxels, volume {:+.3g} %", result.levelSet.grid->activeVoxelCount(), 100 * change));
    auto& report = s.report["advect_level_set"] = {{"voxels", result.levelSet.grid->activeVoxelCount()},
                                                   {"volume_change", change}};
    if (a.text("method") != "weno5") {
        report["traced"] = result.traced;
        report["kept_back"] = result.kept;
        report["unsettled"] = result.unsettled;
        report["surface_shift_mean"] = result.meanShift;
        report["surface_shift_max"] = result.greatestShift;
    }
    if (result.kept > 0)
        s.console.warn(fmt::format("{} of {} voxels found no way back on their tracks; take more steps=", result.kept,
                                   result.traced));
    if (!a.flag("keep")) s.grids.take(age);
    s.grids.push({result.levelSet.grid, nullptr}, s.now());
}

void advectGridAction(Session& s, const Arguments& a) {
    const size_t age = a.given("grid") ? a.ages("grid").front() : 0;
    const openvdb::GridBase::ConstPtr grid = s.grids.at(age).grid;
    const AdvectedGrid result =
        advectGrid(*grid, flowFor(s, a), a.real("begin"), timeOf(s, a),
                   {.map = mapOptions(s, a), .interpolation = static_cast<Interpolation>(a.choice("interpolation"))},
                   s.console.follow("following the grid"));
    s.console.say(fmt::format("grid '{}': {} active voxels", grid->getName(), result.grid->activeVoxelCount()));
    s.report["advect_grid"] = {
        {"voxels", result.grid->activeVoxelCount()}, {"traced", result.traced}, {"kept_back", result.kept}};
    if (!a.flag("keep")) s.grids.take(age);
    s.grids.push({result.grid, nullptr}, s.now());
}

void levelSetToMeshAction(Session& s, const Arguments& a) {
    const size_t age = levelSetAge(s, a);
    auto mesh = std::make_shared<const Mesh>(levelSetToMesh(levelSetAt(s, age), a.real("adaptivity")));
    s.console.say(fmt::format("mesh: {} points, {} faces", mesh->points.size(), mesh->faces()));
    if (!a.flag("keep")) s.grids.take(age);
    s.geometry.push(std::move(mesh), s.now());
}

/// What following needs, and `own` options before the rest.
std::vector<Option> followOptions(std::vector<Option> own) {
    std::vector<Option> options{
        real("time", "1", "s",
             "how long; negative follows the flow backward; after -frames the default is from the first frame to this"),
        integer("steps", "100", 1, 1e9,
                "time steps of equal length; after -frames, from frame to frame, the default is its substeps"),
        real("begin", "0", "s", "the time at which it begins; it matters in flows that change"),
        choice("flow", {"newest", "enright"},
               "the newest flow, or the deformation field of Enright's test, which lives in the box 0,0,0,1,1,1 and "
               "comes back after its period"),
        positive("period", "3", "s", "of flow=enright"),
        choice("scheme", {"euler", "midpoint", "rk4"}, "integrator", "rk4"),
        positive("tolerance", "1e-8", "", "on f and g, relative to their root mean squares"),
        integer("iterations", "10", 1, 1000, "most corrections a step"),
        integer("halvings", "8", 0, 20, "how often a failing step is halved before the voxel waits")};
    options.insert(options.begin() + 2, own.begin(), own.end());
    return options;
}

} // namespace

std::vector<Action> levelSetActions() {
    return {{.name = "advectLevelSet",
             .group = kGroup,
             .summary = "move the newest level set along the newest flow, without diffusing it",
             .inputs = "flow (which stays), grid (level set)",
             .outputs = "grid (level set)",
             .takes = {maybe(stays("flow", {Kind::flow}), "with flow=enright there is none"),
                       taken("levelSet", {Kind::levelSet}, "grid")},
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
             .run = advectLevelSetAction},
            {.name = "advectGrid",
             .group = kGroup,
             .summary = "move a fog volume, or another grid of numbers or vectors, along the newest flow",
             .inputs = "flow (which stays), grid",
             .outputs = "grid",
             .takes = {maybe(stays("flow", {Kind::flow}), "with flow=enright there is none"),
                       taken("grid", {Kind::grid}, "grid")},
             .makes = {made("grid", {Kind::grid})},
             .options = followOptions({choice("interpolation", {"linear", "quadratic"},
                                              "between voxels; quadratic is sharper, but may overshoot"),
                                       ages("grid", "0", "which grid"), keep()}),
             .examples = {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn speed=1 -read "
                          "smoke.vdb grids=density -advectGrid time=0.5 -write moved.vdb"},
             .run = advectGridAction},
            {.name = "ls2mesh",
             .group = kGroup,
             .summary = "turn a level set into a mesh",
             .inputs = "grid (level set)",
             .outputs = "mesh",
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
