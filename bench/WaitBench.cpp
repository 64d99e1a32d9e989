// SPDX-License-Identifier: Apache-2.0
// The jobs that users wait for. Each is one whole job, as an action of the command does it with its defaults. What the
// action takes is made before.

#include "Cases.h"
#include "Inputs.h"
#include "curlew/base/Parallel.h"
#include "curlew/flow/FlowInTime.h"
#include "curlew/picture/Composite.h"
#include "curlew/picture/Display.h"
#include "curlew/picture/Exposure.h"
#include "curlew/render/Splat.h"
#include "curlew/render/SplatValues.h"
#include "curlew/render/SurfacePicture.h"
#include "curlew/track/Advect.h"
#include "curlew/track/Scatter.h"
#include "curlew/track/Trace.h"
#include "curlew/vdb/LevelSetAdvection.h"
#include "curlew/vdb/LevelSetBoolean.h"
#include "curlew/vdb/LevelSetVolume.h"
#include "curlew/vdb/MeshMotion.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/SnapToLevelSet.h"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace curlew::bench {

namespace {

/// Times a job, which is one item, in a process without unused memory.
template <class Job>
void timeJob(benchmark::State& state, int threads, const Job& job) {
    const ThreadLimit limit(threads);
    forgetMemory();
    for (auto _ : state) job();
    state.SetItemsProcessed(state.iterations());
}

template <class Run>
void addWait(const std::string& name, const Run& run) {
    once(add("wait/" + name, [run](benchmark::State& state) { run(state); }))->UseRealTime();
}

Domain boxDomain(const Box& box) { return {.box = box, .wall = std::nullopt}; }

// ---- Pictures

/// -shade width=1280 height=960. `makeSurface` belongs to the action.
template <class MakeSurface>
void shade(benchmark::State& state, const MakeSurface& makeSurface) {
    double coverage = 0;
    timeJob(state, 2, [&] {
        const Surface surface = makeSurface();
        const SurfacePicture picture =
            drawSurface(surface, framing(surface, {.width = 1280, .height = 960}), {.paint = {.box = surface.box()}});
        benchmark::DoNotOptimize(picture.image.pixels.data());
        coverage = picture.coverage;
    });
    state.counters["coverage"] = coverage;
}

void addShade() {
    addWait("shade/mesh", [](auto& state) {
        const auto mesh = spot();
        shade(state, [&] { return Surface(*mesh); });
    });
    addWait("shade/level_set", [](auto& state) {
        const LevelSet levelSet = meshToLevelSet(spot(), {});
        shade(state, [&] { return Surface(widened(levelSet, kSplineSupport)); });
    });
    addWait("shade/isosurface", [](auto& state) {
        const ScalarField noise = noiseField<Psrd3>({}, {.frequency = 2});
        shade(state, [&] { return Surface(noise, 0, Domain{}.box, true); });
    });
}

/// Returns 10⁵ streamlines of 300 vertices, about a pixel apart in a picture of all of them.
Curves streamlines() {
    constexpr size_t kCurves = 100000, kVertices = 300;
    constexpr double kStep = 0.004; // none of them leaves the flow's box
    const Flow flow = freeFlow(boxDomain(Box{}.padded(3)), 2);
    const Points seeds = scatter(boxDomain(Box{}.padded(1)), kCurves, 1);
    return trace(flow, seeds, {.step = kStep, .vertices = kVertices, .closure = 0}).curves;
}

/// -splat of curves: luminous, 960 x 720 pixels.
void splat(benchmark::State& state, int threads) {
    const Curves curves = streamlines();
    size_t drawn = 0;
    timeJob(state, threads, [&] {
        Splats splats = Splats::of(curves);
        const Camera camera = framing(splats, {});
        splats.values = splatValues(curves, SplatValue::speed, camera);
        const Interval range = splatRange(splats.values, SplatValue::speed);
        splats.scale.lower = static_cast<float>(range.lower);
        splats.scale.upper = static_cast<float>(range.upper);
        Image ground = plainPicture(camera.width(), camera.height(), {{0.012F, 0.016F, 0.03F}});
        const SplatImage made = luminous(splats, camera, {}, depthOf(ground));
        const double exposure = automaticExposure(made.image);
        benchmark::DoNotOptimize(developed(withGlow(made.image, 0.15), exposure, std::move(ground)));
        drawn = made.drawn;
    });
    state.counters["vertices"] = static_cast<double>(curves.vertices());
    state.counters["drawn"] = static_cast<double>(drawn);
}

// ---- Level sets

/// Returns spot(), scaled so that the longest edge of its box has this length.
std::shared_ptr<const Mesh> spotOfSize(double size) {
    const auto mesh = spot();
    const Vec3d edges = boundsOf(*mesh).size();
    const double scale = size / std::max({edges[0], edges[1], edges[2]});
    return std::make_shared<const Mesh>(placed(*mesh, {.scale = {{scale, scale, scale}}}));
}

/// -snap of 10⁴ points in a box that is twice the size of the mesh, to the level set of that.
void snapToSpot(benchmark::State& state) {
    constexpr size_t kPoints = 10000;
    const auto mesh = spotOfSize(0.9);
    const LevelSet levelSet = meshToLevelSet(mesh, {});
    const Box box = boundsOf(*mesh);
    const Points start = scatter(boxDomain({box.lower - box.size() * 0.5, box.upper + box.size() * 0.5}), kPoints, 0);
    SnapResult result;
    timeJob(state, 1, [&] {
        Points points = start;
        result = snapToLevelSet(widened(levelSet, kSplineSupport), points, std::numeric_limits<double>::max(),
                                1e-9 * levelSet.voxelSize());
    });
    state.counters["missed"] = static_cast<double>(result.missed);
    state.counters["moved"] = result.moved;
}

struct FrameTime {
    double seconds, voxels;
    double nsPerVoxel() const { return 1e9 * seconds / voxels; }
};

double processorSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// Advects a level set through 24 frames: -frames 1-24 -noise 'time={T}' -noise seed=1 'time={T}' -dfvn speed=1
/// -advectLevelSet restart=0.125. The first frame is the level set itself.
std::vector<FrameTime> advectedFrames(const LevelSet& first) {
    constexpr int kFrames = 24;
    constexpr double kSeconds = 1. / 24;
    const FlowInTime flow([](double time) {
        const auto noise = [&](uint64_t seed) { return noiseField<Psrd3>({.alpha = time, .seed = seed}); };
        return withSpeed(Flow(noise(0), noise(1)), 1);
    });
    FlowMapOptions map = forVoxels({}, first.voxelSize());
    map.step = kSeconds;
    std::vector<FrameTime> frames;
    double before = processorSeconds();
    LevelSetSequence sequence(first, flow, 0, {.map = map, .horizon = 0.125});
    for (int frame = 2; frame <= kFrames; ++frame) {
        const LevelSet levelSet = sequence.advance((frame - 1) * kSeconds).levelSet;
        benchmark::DoNotOptimize(volumeOf(levelSet) / volumeOf(first));
        const double now = processorSeconds();
        frames.push_back({now - before, static_cast<double>(levelSet.grid->activeVoxelCount())});
        before = now;
    }
    return frames;
}

void levelSetSequence(benchmark::State& state) {
    const LevelSet first = meshToLevelSet(spot(), {.dim = 64});
    std::vector<FrameTime> frames;
    timeJob(state, 1, [&] { frames = advectedFrames(first); });
    double slowest = 0;
    for (const FrameTime& frame : frames) slowest = std::max(slowest, frame.seconds);
    state.counters["slowest_frame_s"] = slowest;
    state.counters["first_frame_ns_per_voxel"] = frames.front().nsPerVoxel();
    state.counters["last_frame_ns_per_voxel"] = frames.back().nsPerVoxel();
}

/// Adds the conversion of a closed mesh, ours and OpenVDB's.
template <class MakeMesh>
void addMeshToLevelSet(const std::string& name, int dim, const MakeMesh& makeMesh) {
    addWait(fmt::format("mesh2ls/{}{}", name, dim), [=](auto& state) {
        const std::shared_ptr<const Mesh> mesh = makeMesh();
        timeJob(state, 1, [&] { benchmark::DoNotOptimize(meshToLevelSet(mesh, {.dim = dim}).grid); });
    });
    addWait(fmt::format("mesh2ls/{}{}_openvdb", name, dim), [=](auto& state) {
        const std::shared_ptr<const Mesh> mesh = makeMesh();
        timeJob(state, 1, [&] { benchmark::DoNotOptimize(openVdbLevelSet(*mesh, dim)); });
    });
}

// ---- Points

/// -sphere -noise frequency=3 -surface speed=1 -scatter count=20000 -advect duration=2 steps=100 scheme=rk4.
void advectOnSurface(benchmark::State& state, Reprojection method) {
    constexpr size_t kPoints = 20000;
    constexpr double kExtent = 0.06; // of the flow beyond the surface, relative to the diagonal
    const Sdf sphere = sphereSdf(1);
    const Box box = sphere.bounds.padded(kExtent * length(sphere.bounds.size()));
    const Flow flow = withSpeed(Flow(noiseField<Psrd3>({}, {.frequency = 3}), sphere.distance, boxDomain(box)), 1);
    const Points start = scatter(flow.domain(), kPoints, 0);
    AdvectResult result;
    timeJob(state, 1, [&] {
        Points points = start;
        result =
            advect(flow, points, {.time = 2, .steps = 100, .scheme = Scheme::rk4, .reprojection = {.method = method}});
    });
    state.counters["not_converged"] = static_cast<double>(result.notConverged) / kPoints;
    state.counters["corrections"] = result.meanIterations;
}

double meanDistance(const Points& a, const Points& b) {
    double sum = 0;
    for (size_t k = 0; k < a.size(); ++k) sum += length(a.position(k) - b.position(k));
    return sum / static_cast<double>(a.size());
}

/// Moves particles inside a mesh for a second; a particle's whole path is an item. Sets the counter "error": their mean
/// distance from where adaptive steps of a far better accuracy take them.
void advectInMesh(benchmark::State& state, AdvectOptions options) {
    constexpr size_t kParticles = 20000; // of few, the last ones would leave lanes idle
    const ThreadLimit limit(1);
    static const Flow flow = flowInSpot(true); // measured once
    static const Points start = scatter(insideSpot(), kParticles, 1);
    static const Points exact = [] {
        Points particles = start;
        advect(flow, particles, {.time = 1, .accuracy = 1e-9});
        return particles;
    }();
    Points particles;
    options.time = 1;
    for (auto _ : state) {
        particles = start;
        advect(flow, particles, options);
    }
    state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(kParticles));
    state.counters["error"] = meanDistance(particles, exact);
}

void addPoints() {
    addWait("surface/newton", [](auto& state) { advectOnSurface(state, Reprojection::newton); });
    addWait("surface/gauss-newton", [](auto& state) { advectOnSurface(state, Reprojection::gaussNewton); });
    addWait("in_mesh/rk4", [](auto& state) { advectInMesh(state, {.steps = 100, .scheme = Scheme::rk4}); });
    for (const auto& [name, accuracy] : {std::pair("3e-4", 3e-4), std::pair("1e-4", 1e-4)})
        addWait(fmt::format("in_mesh/adaptive_{}", name), [accuracy = accuracy](auto& state) {
            advectInMesh(state, {.scheme = Scheme::bogackiShampine, .accuracy = accuracy});
        });
}

} // namespace

void registerWait() {
    addShade();
    addWait("snap/level_set", snapToSpot);
    addWait("splat/light", [](auto& state) { splat(state, 1); });
    addWait("splat/light_two_threads", [](auto& state) { splat(state, 2); });
    addWait("sequence", levelSetSequence);
    addMeshToLevelSet("spot", 192, spot);
    addMeshToLevelSet("million", 512, [] { return bumpyBall(289); });
    addPoints();
}

} // namespace curlew::bench
