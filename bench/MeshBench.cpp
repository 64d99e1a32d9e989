// SPDX-License-Identifier: Apache-2.0
// Meshes to level sets, beside OpenVDB's meshToVolume, which needs closed meshes; and winding numbers, beside their
// exact sum.

#include "Cases.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/MeshSolid.h"
#include "curlew/vdb/WindingNumber.h"

#include <fmt/format.h>
#include <openvdb/tools/MeshToVolume.h>

#include <cmath>
#include <map>
#include <memory>
#include <numbers>

namespace curlew::bench {

namespace {

constexpr int kDim = 256;

/// A closed mesh of 12 n² triangles: a sphere with bumps, made of the faces of a cube.
std::shared_ptr<const Mesh> bumpyBall(int n) {
    auto mesh = std::make_shared<Mesh>();
    std::map<std::array<int, 3>, openvdb::Index32> known;
    const auto vertex = [&](const std::array<int, 3>& at) {
        const auto [entry, isNew] = known.emplace(at, static_cast<openvdb::Index32>(mesh->points.size()));
        if (isNew) {
            openvdb::Vec3d p;
            for (int axis = 0; axis < 3; ++axis)
                p[axis] = std::tan((2.0 * at[static_cast<size_t>(axis)] / n - 1) * std::numbers::pi / 4);
            p.normalize();
            p *= 1 + 0.1 * std::sin(7 * p[1]) * std::sin(5 * p[0]) + 0.05 * std::sin(9 * p[2]);
            mesh->points.emplace_back(openvdb::Vec3s(p));
        }
        return entry->second;
    };
    for (size_t axis = 0; axis < 3; ++axis)
        for (const int side : {0, n})
            for (int i = 0; i < n; ++i)
                for (int j = 0; j < n; ++j) {
                    const auto corner = [&](int a, int b) {
                        std::array<int, 3> at{};
                        at[axis] = side, at[(axis + 1) % 3] = a, at[(axis + 2) % 3] = b;
                        return vertex(at);
                    };
                    openvdb::Vec4I q(corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1));
                    if (side == 0) std::swap(q[1], q[3]);
                    mesh->triangles.emplace_back(q[0], q[1], q[2]);
                    mesh->triangles.emplace_back(q[0], q[2], q[3]);
                }
    return mesh;
}

double voxelOf(const Mesh& mesh) {
    openvdb::BBoxd box;
    for (const auto& p : mesh.points) box.expand(openvdb::Vec3d(p));
    return box.extents()[box.maxExtent()] / kDim;
}

void solid(benchmark::State& state, int n) {
    const ThreadLimit limit(2);
    const auto mesh = bumpyBall(n);
    for (auto _ : state) benchmark::DoNotOptimize(solidOf(mesh, {.dim = kDim}).levelSet.grid);
    state.SetItemsProcessed(state.iterations());
}

void openVdb(benchmark::State& state, int n) {
    const ThreadLimit limit(2);
    const auto mesh = bumpyBall(n);
    const auto transform = openvdb::math::Transform::createLinearTransform(voxelOf(*mesh));
    for (auto _ : state)
        benchmark::DoNotOptimize(
            openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(*transform, mesh->points, mesh->triangles, 3));
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
