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

// Each file has one topic and registers its cases; their names are paths, such as "dfvn/float/random". All run on one
// thread unless the name ends in "2threads", and count items (points, voxels, particle steps): report.py turns those
// into times, and compares cases by name.
void registerRoofline();
void registerNoise();
void registerGrid();
void registerAdvect();
void registerEnright();
void registerWarp();

/// So many batches are worked through in turn that branches and tables cannot be learned by heart.
inline constexpr int kBatches = 64;

/// Points that have nothing to do with one another, in [0, edge)³.
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

/// Voxels as a sampler of grids meets them, `step` apart: a batch is a layer of a leaf, in rows along z.
std::vector<PointBatch> rowBatches(double step);

/// The voxels of a cell of noise along one axis, where nothing else is said.
inline constexpr int kVoxelsPerCell = 32;

/// The flow of two noises without a wall.
Flow freeFlow(const Domain& domain = {}, double frequency = 1);

/// The domain that holds the voxels 0 … dim-1 along each axis, kVoxelsPerCell of them to a cell of noise.
Domain voxelDomain(int dim);

/// Adds a case under a name that is only known at run time.
template <class F>
benchmark::internal::Benchmark* add(const std::string& name, F&& run) {
    return benchmark::RegisterBenchmark(name.c_str(), std::forward<F>(run));
}

/// For cases that take a second or so: once is enough, the driver repeats the whole run.
inline benchmark::internal::Benchmark* once(benchmark::internal::Benchmark* added) { return added->Iterations(1); }

} // namespace curlew::bench
