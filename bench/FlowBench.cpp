// What the main job spends its time on, per position, voxel or particle step. Compare within one run only.

#include "curlew/base/Parallel.h"
#include "curlew/base/Random.h"
#include "curlew/field/NoiseField.h"
#include "curlew/track/Advect.h"
#include "curlew/track/Scatter.h"
#include "curlew/vdb/VelocityGrid.h"

#include <benchmark/benchmark.h>

namespace {

using namespace curlew;

PointBatch randomPoints() {
    PointBatch points;
    for (uint64_t k = 0; !points.full(); ++k)
        points.push({{20 * randomUniform(1, k, 0), 20 * randomUniform(1, k, 1), 20 * randomUniform(1, k, 2)}});
    return points;
}

Flow freeFlow() { return Flow(noiseField<Psrd3>({.seed = 1}), noiseField<Psrd3>({.seed = 2})); }

Flow containedFlow() {
    const Wall wall{.sdf = sphereSdf(1), .side = Side::inside, .width = 0.1};
    const OctaveOptions octaves{.frequency = 3, .octaves = 2};
    return Flow(noiseField<Psrd3>({.seed = 1}, octaves), bounded(noiseField<Psrd3>({.seed = 2}, octaves), wall),
                Domain::of(wall));
}

template <class T, int Order>
void psrd(benchmark::State& state) {
    const ScalarField field = noiseField<Psrd3>({.seed = 1});
    const PointBatch points = randomPoints();
    JetBatch<T, Order> jets;
    for (auto _ : state) {
        field.eval(points, jets);
        benchmark::DoNotOptimize(jets);
    }
    state.SetItemsProcessed(state.iterations() * kBatch);
}
BENCHMARK(psrd<float, 0>);
BENCHMARK(psrd<float, 1>);
BENCHMARK(psrd<float, 2>);
BENCHMARK(psrd<double, 0>);
BENCHMARK(psrd<double, 1>);
BENCHMARK(psrd<double, 2>);

template <class T>
void dfvn(benchmark::State& state) {
    const Flow flow = freeFlow();
    const PointBatch points = randomPoints();
    VecBatch<T> velocity;
    for (auto _ : state) {
        flow.velocity(points, velocity);
        benchmark::DoNotOptimize(velocity);
    }
    state.SetItemsProcessed(state.iterations() * kBatch);
}
BENCHMARK(dfvn<float>);
BENCHMARK(dfvn<double>);

void velocity(benchmark::State& state, const Flow& flow, Layout layout) {
    const ThreadLimit limit(static_cast<int>(state.range(0)));
    int64_t voxels = 0;
    for (auto _ : state)
        voxels += static_cast<int64_t>(velocityGrid(flow, {.dim = 96, .layout = layout})->activeVoxelCount());
    state.SetItemsProcessed(voxels);
}
BENCHMARK_CAPTURE(velocity, free_collocated, freeFlow(), Layout::collocated)
    ->Arg(1)
    ->Arg(2)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(velocity, free_staggered, freeFlow(), Layout::staggered)
    ->Arg(1)
    ->Arg(2)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(velocity, contained_collocated, containedFlow(), Layout::collocated)
    ->Arg(1)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void advection(benchmark::State& state, Reprojection method) {
    const ThreadLimit limit(static_cast<int>(state.range(0)));
    const Flow flow = withSpeed(containedFlow(), 1);
    const Particles start = scatter(flow.domain(), 4096, 1);
    constexpr int kSteps = 20;
    for (auto _ : state) {
        Particles particles = start;
        advect(flow, particles, {.time = 0.4, .steps = kSteps, .reprojection = method});
        benchmark::DoNotOptimize(particles);
    }
    state.SetItemsProcessed(state.iterations() * kSteps * static_cast<int64_t>(start.size()));
}
BENCHMARK_CAPTURE(advection, rk4, Reprojection::none)->Arg(1)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(advection, rk4_newton, Reprojection::newton)->Arg(1)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(advection, rk4_gauss_newton, Reprojection::gaussNewton)
    ->Arg(1)
    ->Arg(2)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

} // namespace
