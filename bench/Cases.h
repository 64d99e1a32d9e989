// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Random.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flow.h"

#include <benchmark/benchmark.h>

#include <string>
#include <utility>
#include <vector>

namespace curlew::bench {

// Each file has one topic and registers its cases. Their names are paths, such as "dfvn/float/random". All cases run on
// one thread unless the name ends in "2threads" or begins with "wait/shade". They count items (points, voxels, particle
// steps), from which report.py computes times. It compares cases by name.
void registerRoofline();
void registerNoise();
void registerGrid();
void registerAdvect();
void registerEnright();
void registerWarp();
void registerMesh();
void registerWait();
void registerGpu(); ///< Registers nothing if there is no GPU.

/// Number of batches that are processed in turn, large enough to defeat branch prediction and caching.
inline constexpr int kBatches = 64;

/// Independent random points in [0, edge)³.
template <int N>
std::vector<PointBatchN<N>> randomBatches(double edge) {
    std::vector<PointBatchN<N>> batches(kBatches);
    uint64_t k = 0;
    for (PointBatchN<N>& points : batches)
        for (; !points.full(); ++k) {
            Vec<double, N> p;
            for (int axis = 0; axis < N; ++axis) p[axis] = edge * randomUniform(1, k, static_cast<uint64_t>(axis));
            points.push(p);
        }
    return batches;
}

/// Voxels in the order in which a grid sampler visits them, `step` apart: a batch is a layer of a leaf, in rows along
/// z.
std::vector<PointBatch> rowBatches(double step);

/// Default number of voxels per cell of noise along an axis.
inline constexpr int kVoxelsPerCell = 32;

/// Returns the flow of two noises without a wall.
Flow freeFlow(const Domain& domain = {}, double frequency = 1);

/// Returns the domain with the voxels 0 … dim-1 along each axis, kVoxelsPerCell of them per cell of noise.
Domain voxelDomain(int dim);

/// Returns memory that earlier cases have freed to the system. A process that makes a grid then gets all of its memory
/// from the system, which takes longer than filling it.
void forgetMemory();

/// Adds a case whose name is only known at run time.
template <class F>
benchmark::internal::Benchmark* add(const std::string& name, F&& run) {
    return benchmark::RegisterBenchmark(name.c_str(), std::forward<F>(run));
}

/// For cases that take about a second: runs one iteration, since the driver repeats the whole run.
inline benchmark::internal::Benchmark* once(benchmark::internal::Benchmark* added) { return added->Iterations(1); }

} // namespace curlew::bench
