// SPDX-License-Identifier: Apache-2.0
// The room gpu on the preferred GPU, and the processor beside it, with all its threads. Times are those of the programs
// on the device where a name ends in "device"; otherwise transfers and the work of the processor are included.

#include "Cases.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/Bound.h"
#include "curlew/flow/FlowScale.h"
#include "curlew/gpu/GpuAdvect.h"
#include "curlew/gpu/GpuPictures.h"
#include "curlew/track/AdvectParts.h"
#include "curlew/track/Scatter.h"
#include "curlew/vdb/LevelSet.h"
#include "curlew/vdb/MeshFile.h"
#include "curlew/vdb/MeshSolid.h"
#include "curlew/vdb/VelocityGrid.h"

#include <fmt/format.h>

#include <chrono>

namespace curlew::bench {

namespace {

std::shared_ptr<Gpu> gpu() {
    static const auto opened = Gpu::open(preferredGpu(gpus()));
    return opened;
}

/// Returns `count`, or less for a device in software, which takes as long for that.
size_t many(size_t count) { return gpu()->info().software ? count >> 8 : count; }

/// Keeps the GPU busy for a while, because the clock of an idle one is low.
void warmUp() {
    static const GpuFlowN<3> flow(gpu(), Flow(noiseField<Psrd3>({.seed = 1}), noiseField<Psrd3>({.seed = 2})));
    GpuPointsN<3> points;
    points.position.resize(many(1 << 20));
    flow.move(points, {.scheme = Scheme::euler, .time = 1, .steps = 2000, .corrections = 0, .guarded = false});
}

/// Repeats `run` and counts only the time for which programs run on the GPU.
template <class Run>
void timeOnDevice(benchmark::State& state, const Run& run) {
    using Clock = std::chrono::steady_clock;
    run(); // compiles
    double all = 0;
    for (auto _ : state) {
        state.PauseTiming();
        warmUp();
        state.ResumeTiming();
        const double before = gpu()->busy();
        const auto begin = Clock::now();
        run();
        state.SetIterationTime(gpu()->busy() - before);
        all += std::chrono::duration<double>(Clock::now() - begin).count();
    }
    state.counters["seconds_with_transfers"] = all / static_cast<double>(state.iterations());
    state.SetLabel(gpu()->info().name);
}

/// The flow of the particles, at an rms speed of 1: noises without a wall, in the unit ball, or in a mesh.
Flow noisesOf(int octaves) {
    const auto noise = [&](uint64_t seed) {
        return noiseField<Psrd3>({.seed = seed}, {.frequency = 1.5, .octaves = octaves});
    };
    return withSpeed(Flow(noise(1), noise(2)), 1);
}
Flow inside(const WallN<3>& wall, double frequency, int octaves) {
    const auto noise = [&](uint64_t seed) {
        return noiseField<Psrd3>({.seed = seed}, {.frequency = frequency, .octaves = octaves});
    };
    return withSpeed(Flow(noise(1), bounded(noise(2), wall), Domain::of(wall, 0.5)), 1);
}
Flow inBall() { return inside({.sdf = sphereSdf(1), .side = Side::inside, .width = 0.3}, 1.5, 2); }
/// scenes/spot.obj, 192 voxels across. Its layer is a twelfth of its size.
Flow inSpot() {
    constexpr int kDim = 192;
    const LevelSet narrow =
        solidOf(std::make_shared<const Mesh>(readMesh(CURLEW_SCENES "/spot.obj")), {.dim = kDim}).levelSet;
    return inside({.sdf = sdfOf(widened(narrow, kDim / 12 + kSplineSupport)),
                   .side = Side::inside,
                   .width = kDim / 12 * narrow.voxelSize()},
                  2.5, 2);
}

// ---- Velocities

/// DFVN without transfers and without memory: one evaluation per step of Euler's method.
void dfvn(benchmark::State& state, const Flow& flow, ShaderCoordinates coordinates) {
    const size_t count = many(1 << 20);
    constexpr int kSteps = 4000;
    const GpuFlowN<3> onGpu(gpu(), flow, coordinates);
    GpuPointsN<3> start;
    for (size_t k = 0; k < count; ++k)
        start.position.push_back({{randomUniform(1, k, 0), randomUniform(1, k, 1), randomUniform(1, k, 2)}});
    timeOnDevice(state, [&] {
        GpuPointsN<3> points = start;
        onGpu.move(points, {.scheme = Scheme::euler, .time = 1, .steps = kSteps, .corrections = 0, .guarded = false});
    });
    state.SetItemsProcessed(state.iterations() * kSteps * static_cast<int64_t>(count));
}

constexpr int kDim = 256;

/// The velocities of a grid of 256³ voxels.
void velocities(benchmark::State& state) {
    const Flow flow = freeFlow(voxelDomain(kDim));
    const double voxel = flow.domain().box.size()[0] / kDim;
    const GpuFlowN<3> onGpu(gpu(), flow);
    std::vector<Vec3d> positions;
    for (int i = 0; i < kDim; ++i)
        for (int j = 0; j < kDim; ++j)
            for (int k = 0; k < kDim; ++k) positions.push_back({{i * voxel, j * voxel, k * voxel}});
    std::vector<Vec3f> result;
    timeOnDevice(state, [&] { onGpu.velocities(positions, result); });
    state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(positions.size()));
}

/// The same as an OpenVDB grid.
void grid(benchmark::State& state, bool onGpu) {
    const Flow flow = freeFlow(voxelDomain(kDim));
    VelocityGridOptions options{.dim = kDim};
    if (onGpu)
        options.source = [](const Flow& given) -> VelocitySource {
            return [made = std::make_shared<const GpuFlowN<3>>(gpu(), given)](const auto& positions, auto& result) {
                made->velocities(positions, result);
            };
        };
    velocityGrid(flow, options);
    for (auto _ : state) benchmark::DoNotOptimize(velocityGrid(flow, options));
    state.SetItemsProcessed(state.iterations() * kDim * kDim * kDim);
}

// ---- Particles

size_t particleCount() { return many(1 << 20); }

/// Steps of RK4, reprojected or not, 0.02 s long.
void particles(benchmark::State& state, const Flow& flow, bool reprojects) {
    constexpr int kSteps = 200;
    const GpuFlowN<3> onGpu(gpu(), flow);
    const Points start = scatter(flow.domain(), particleCount(), 1);
    const std::vector<uint32_t> order = advectionOrder(flow, start);
    GpuMoved moved;
    timeOnDevice(state, [&] {
        GpuPointsN<3> points;
        for (size_t k = 0; k < start.size(); ++k)
            points.position.push_back(start.position(order.empty() ? k : order[k]));
        moved = onGpu.move(
            points, {.time = 0.02 * kSteps, .steps = kSteps, .corrections = reprojects ? 4 : 0, .guarded = reprojects});
    });
    state.SetItemsProcessed(state.iterations() * kSteps * static_cast<int64_t>(particleCount()));
    state.counters["corrections"] = static_cast<double>(moved.corrections) / static_cast<double>(moved.substeps);
    state.counters["not_taken"] = static_cast<double>(moved.stalled);
}

/// -advect with its defaults, or 100 equal steps.
void advection(benchmark::State& state, const Flow& flow, int steps, bool onGpu) {
    const Points start = scatter(flow.domain(), particleCount(), 1);
    const AdvectOptions options{.time = 1, .steps = steps};
    AdvectResult result;
    const auto run = [&] {
        Points moving = start;
        result = onGpu ? advectOnGpu(gpu(), flow, moving, options) : advect(flow, moving, options);
    };
    run();
    for (auto _ : state) run();
    state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(result.substeps));
    state.counters["outside"] = static_cast<double>(result.outside);
    state.counters["not_converged"] = static_cast<double>(result.notConverged);
    state.counters["residual_f"] = result.residual[0];
}

// ---- Pictures

/// A frame of ICN Table 2: positions of 1024 x 576 pixels; without the lookup of their colours.
void warpFrame(benchmark::State& state, Scheme scheme, int steps, int corrections) {
    constexpr int kWidth = 1024, kHeight = 576;
    const FlowN<2> flow(FlowN<2>::Potentials{noiseField<GradientNoise<2>>({}, {.frequency = 7})},
                        {.box = {{{0, 0}}, {{16.0 / 9, 1}}}, .wall = {}});
    std::vector<Vec<double, 2>> pixels;
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) pixels.push_back({{(x + 0.5) / kWidth * 16 / 9, 1 - (y + 0.5) / kHeight}});
    const Warper warper = warperOn(gpu());
    timeOnDevice(state, [&] {
        auto positions = pixels;
        warper(flow, positions, {.time = 0.5, .steps = steps, .scheme = scheme, .corrections = corrections}, {});
    });
    state.counters["frames_per_second"] = benchmark::Counter(1, benchmark::Counter::kIsIterationInvariantRate);
}

void licFrame(benchmark::State& state, bool onGpu) {
    constexpr int kWidth = 1280, kHeight = 960;
    Image vectors = filledImage(kWidth, kHeight, {"right", "up"});
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
            vectors.at(x, y, 0) = static_cast<float>(std::sin(0.02 * y));
            vectors.at(x, y, 1) = static_cast<float>(std::cos(0.03 * x));
        }
    const LicOptions options{.length = 0.06 * kWidth};
    const LicConvolution convolution = onGpu ? convolutionOn(gpu()) : LicConvolution(convolved);
    benchmark::DoNotOptimize(lic(vectors, options, {}, convolution));
    for (auto _ : state) benchmark::DoNotOptimize(lic(vectors, options, {}, convolution));
}

template <class F>
void addOnDevice(const std::string& name, F&& run) {
    add(name, std::forward<F>(run))->Iterations(5)->UseManualTime();
}
template <class F>
void addWhole(const std::string& name, F&& run) {
    add(name, std::forward<F>(run))->Iterations(3)->UseRealTime();
}

} // namespace

void registerGpu() {
    try {
        gpu();
    } catch (const GpuError& e) {
        fmt::print(stderr, "no cases gpu/…: {}\n", e.what());
        return;
    }
    for (const auto& [name, coordinates] :
         {std::pair("device", ShaderCoordinates::doubles), std::pair("pairs/device", ShaderCoordinates::pairs)}) {
        const auto addDfvn = [&, coordinates = coordinates](const std::string& of, auto flow) {
            addOnDevice(fmt::format("gpu/dfvn/{}/{}", of, name),
                        [flow, coordinates](auto& state) { dfvn(state, flow(), coordinates); });
        };
        addDfvn("psrd", [] { return noisesOf(1); });
        addDfvn("psrd/2octaves", [] { return noisesOf(2); });
        addDfvn("ball/2octaves", [] { return inBall(); });
    }
    addOnDevice("gpu/velocities/256/device", velocities);
    for (const bool onGpu : {true, false})
        addWhole(fmt::format("gpu/grid/256/{}", onGpu ? "gpu" : "processor"),
                 [onGpu](auto& state) { grid(state, onGpu); });
    for (const bool reprojects : {true, false}) {
        const std::string end = reprojects ? "reprojected/device" : "device";
        addOnDevice("gpu/particles/1octave/" + end, [=](auto& state) { particles(state, noisesOf(1), reprojects); });
        addOnDevice("gpu/particles/2octaves/" + end, [=](auto& state) { particles(state, noisesOf(2), reprojects); });
        addOnDevice("gpu/particles/ball/" + end, [=](auto& state) { particles(state, inBall(), reprojects); });
        addOnDevice("gpu/particles/mesh/" + end, [=](auto& state) { particles(state, inSpot(), reprojects); });
    }
    for (const bool onGpu : {true, false}) {
        const std::string end = onGpu ? "gpu" : "processor";
        addWhole("gpu/advect/ball/100steps/" + end, [=](auto& state) { advection(state, inBall(), 100, onGpu); });
        addWhole("gpu/advect/ball/" + end, [=](auto& state) { advection(state, inBall(), 0, onGpu); });
        addWhole("gpu/advect/mesh/100steps/" + end, [=](auto& state) { advection(state, inSpot(), 100, onGpu); });
    }
    for (const auto& [name, scheme] : {std::pair("euler", Scheme::euler), std::pair("rk4", Scheme::rk4)})
        for (const int steps : {64, 512})
            for (const int corrections : {0, 1, 10})
                addOnDevice(fmt::format("gpu/warp/{}/{}steps/{}corrections/device", name, steps, corrections),
                            [=, scheme = scheme](auto& state) { warpFrame(state, scheme, steps, corrections); });
    for (const bool onGpu : {true, false})
        addWhole(fmt::format("gpu/lic/{}", onGpu ? "gpu" : "processor"),
                 [onGpu](auto& state) { licFrame(state, onGpu); });
}

} // namespace curlew::bench
