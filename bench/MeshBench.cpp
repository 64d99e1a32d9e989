// SPDX-License-Identifier: Apache-2.0
// Meshes to level sets, beside OpenVDB's meshToVolume, which needs closed meshes; and winding numbers, beside their
// exact sum.

#include "Cases.h"
#include "Inputs.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/MeshSolid.h"
#include "curlew/vdb/WindingNumber.h"

#include <fmt/format.h>

#include <utility>

namespace curlew::bench {

namespace {

constexpr int kDim = 256;

void solid(benchmark::State& state, int n) {
    const ThreadLimit limit(2);
    const auto mesh = bumpyBall(n);
    for (auto _ : state) benchmark::DoNotOptimize(solidOf(mesh, {.dim = kDim}).levelSet.grid);
    state.SetItemsProcessed(state.iterations());
}

void openVdb(benchmark::State& state, int n) {
    const ThreadLimit limit(2);
    const auto mesh = bumpyBall(n);
    for (auto _ : state) benchmark::DoNotOptimize(openVdbLevelSet(*mesh, kDim));
    state.SetItemsProcessed(state.iterations());
}

void winding(benchmark::State& state, int n, bool exact) {
    const auto mesh = bumpyBall(n);
    const WindingNumber number(*mesh);
    uint64_t k = 0;
    for (auto _ : state) {
        Vec3d p;
        for (int axis = 0; axis < 3; ++axis) p[axis] = 2.4 * randomUniform(1, k, static_cast<uint64_t>(axis)) - 1.2;
        benchmark::DoNotOptimize(exact ? number.exactAt(p) : number.at(p));
        ++k;
    }
    state.SetItemsProcessed(state.iterations());
}

void windingTree(benchmark::State& state, int n) {
    const ThreadLimit limit(2);
    const auto mesh = bumpyBall(n);
    for (auto _ : state) benchmark::DoNotOptimize(WindingNumber(*mesh));
    state.SetItemsProcessed(state.iterations());
}

} // namespace

void registerMesh() {
    for (const auto& [faces, n] : {std::pair("1e4", 29), std::pair("1e5", 91), std::pair("1e6", 289)}) {
        const int edge = n;
        once(add(fmt::format("mesh/solid/{}/2threads", faces), [=](auto& state) {
            solid(state, edge);
        }))->UseRealTime();
        once(add(fmt::format("mesh/openvdb/{}/2threads", faces), [=](auto& state) {
            openVdb(state, edge);
        }))->UseRealTime();
        once(add(fmt::format("winding/tree/{}/2threads", faces), [=](auto& state) {
            windingTree(state, edge);
        }))->UseRealTime();
        add(fmt::format("winding/fast/{}", faces), [=](auto& state) { winding(state, edge, false); });
        add(fmt::format("winding/exact/{}", faces), [=](auto& state) { winding(state, edge, true); });
    }
}

} // namespace curlew::bench
