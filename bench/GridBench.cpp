// SPDX-License-Identifier: Apache-2.0
// Velocity grids: dense, with walls, and sparse; and the same grids made by other software.

#include "Cases.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/LevelSet.h"
#include "curlew/vdb/VelocityGrid.h"

#include <fmt/format.h>
#include <malloc.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <openvdb_ax/ax.h>
#include <openvdb_ax/compiler/Compiler.h>
#include <openvdb_ax/compiler/VolumeExecutable.h>

#include <limits>

namespace curlew::bench {

namespace {

using openvdb::Coord;

constexpr int kDim = 256; ///< Voxels of the dense grids along an edge.

void countVoxels(benchmark::State& state, const openvdb::GridBase& grid) {
    const auto voxels = grid.activeVoxelCount();
    state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(voxels));
    state.counters["bytes"] = static_cast<double>(grid.memUsage());
    state.counters["bytes_per_item"] = static_cast<double>(grid.memUsage()) / static_cast<double>(voxels);
}

void velocity(benchmark::State& state, const Flow& flow, const VelocityGridOptions& options, int threads = 1) {
    const ThreadLimit limit(threads);
    openvdb::Vec3SGrid::Ptr grid; // outside the loop, so that freeing the memory is not timed
    forgetMemory();
    for (auto _ : state) grid = velocityGrid(flow, options);
    countVoxels(state, *grid);
}

/// Times velocityGrid() in memory that the process already has, so that mainly the kernels are timed.
void velocityAgain(benchmark::State& state, const Flow& flow, const VelocityGridOptions& options) {
    const ThreadLimit limit(1);
    mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
    openvdb::Vec3SGrid::Ptr grid = velocityGrid(flow, options);
    for (auto _ : state) {
        state.PauseTiming();
        grid.reset();
        state.ResumeTiming();
        grid = velocityGrid(flow, options);
    }
    countVoxels(state, *grid);
}

constexpr std::pair<const char*, Layout> kLayouts[] = {{"collocated", Layout::collocated},
                                                       {"staggered", Layout::staggered}};

/// Adds the cases for the whole cube, including those that show how the time scales.
void addDense() {
    for (const auto& [name, layout] : kLayouts) {
        const VelocityGridOptions options{.dim = kDim, .layout = layout};
        for (const int threads : {1, 2})
            once(add(fmt::format("velocity/{}/{}", name, threads == 1 ? "1thread" : "2threads"), [=](auto& state) {
                velocity(state, freeFlow(voxelDomain(kDim)), options, threads);
            }))->UseRealTime();
        add(fmt::format("velocity/{}/again", name), [=](auto& state) {
            velocityAgain(state, freeFlow(voxelDomain(kDim)), options);
        })->Iterations(3);
    }
    for (const int dim : {32, 64, 128, kDim})
        once(add(fmt::format("scale/voxels/{}", int64_t{dim} * dim * dim),
                 [=](auto& state) { velocity(state, freeFlow(voxelDomain(dim)), {.dim = dim}); }));
}

/// Times filling a tree with new leaves: the minimal work for making a dense grid.
void fill(benchmark::State& state) {
    const ThreadLimit limit(1);
    using Tree = openvdb::Vec3STree;
    constexpr int kLeaf = static_cast<int>(Tree::LeafNodeType::DIM), kAlong = kDim / kLeaf;
    constexpr size_t kCount = size_t{kAlong} * kAlong * kAlong;
    openvdb::Vec3SGrid::Ptr grid;
    forgetMemory();
    for (auto _ : state) {
        std::vector<std::unique_ptr<Tree::LeafNodeType>> leaves(kCount);
        parallelFor(kCount, 8, [&](size_t begin, size_t end) {
            for (size_t n = begin; n < end; ++n) {
                const auto at = [&](size_t stride) { return static_cast<int>(n / stride % kAlong) * kLeaf; };
                const Coord origin(at(size_t{kAlong} * kAlong), at(kAlong), at(1));
                const openvdb::Vec3s value(origin.asVec3s());
                leaves[n] = std::make_unique<Tree::LeafNodeType>(origin, value, true);
            }
        });
        grid = openvdb::Vec3SGrid::create();
        for (auto& leaf : leaves) grid->tree().addLeaf(leaf.release());
    }
    countVoxels(state, *grid);
}

/// Times the code that vdb_ax runs, without file input and output, compiled for this processor with full optimisation.
void curlSimplexNoise(benchmark::State& state) {
    const ThreadLimit limit(1);
    namespace ax = openvdb::ax;
    ax::initialize();
    ax::Compiler compiler(ax::CompilerOptions{.mOptLevel = ax::CompilerOptions::OptLevel::O3});
    const auto program = compiler.compile<ax::VolumeExecutable>("v@vel = curlsimplexnoise(getvoxelpws());");
    const auto grid = openvdb::Vec3SGrid::create();
    grid->setName("vel");
    grid->setTransform(openvdb::math::Transform::createLinearTransform(1.0 / kVoxelsPerCell));
    grid->denseFill(openvdb::CoordBBox(Coord(0), Coord(kDim - 1)), openvdb::Vec3s(0), true);
    for (auto _ : state) program->execute(*grid);
    countVoxels(state, *grid);
}

// ---- Walls

constexpr double kFrequency = 2;   ///< Frequency of the noises, for shapes of radius 1.
constexpr double kVoxel = 1. / 64; ///< Voxel size, which gives kVoxelsPerCell voxels per cell.

Flow contained(const Sdf& shape) {
    const Wall wall{.sdf = shape, .side = Side::inside, .width = 0.1};
    const OctaveOptions octaves{.frequency = kFrequency};
    return Flow(noiseField<Psrd3>({.seed = 1}, octaves), bounded(noiseField<Psrd3>({.seed = 2}, octaves), wall),
                Domain::of(wall));
}

/// Returns a level set of a sphere with radius 1 and a diameter of 192 voxels. Its narrow band is wide enough for the
/// wall.
Sdf levelSetSphere() {
    constexpr float kLevelSetVoxel = 2.0F / 192, kHalfWidth = 14;
    return sdfOf(levelSetOf(
        openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(1, openvdb::Vec3f(0), kLevelSetVoxel, kHalfWidth)));
}

void addWalls() {
    // Each flow is made by the first case that needs it, since a level set takes a while.
    const auto unbounded = [] { return freeFlow({.box = sphereSdf(1).bounds, .wall = std::nullopt}, kFrequency); };
    const auto inSphere = [] { return contained(sphereSdf(1)); };
    const auto inLevelSet = [] {
        static const Flow flow = contained(levelSetSphere());
        return flow;
    };
    for (const auto& [name, layout] : kLayouts) {
        const VelocityGridOptions options{.voxel = kVoxel, .layout = layout};
        const auto addWall = [&, name = name](const char* wall, const auto& flow) {
            once(add(fmt::format("bounded/{}/{}", wall, name), [=](auto& state) { velocity(state, flow(), options); }));
        };
        addWall("none", unbounded);
        addWall("sphere", inSphere);
        addWall("level_set", inLevelSet);
    }
}

/// Adds cases for a shell of radius 1 and thickness 0.05, which has few of the voxels of its box of size 2.
void addShells() {
    const Wall shell{.sdf = subtract(sphereSdf(1), sphereSdf(0.95), 0), .side = Side::inside, .width = 0.02};
    const Flow flow = freeFlow(Domain::of(shell), kFrequency);
    for (const int dim : {256, 512, 1024})
        once(add(fmt::format("shell/{}", dim), [=](auto& state) { velocity(state, flow, {.voxel = 2.0 / dim}); }));
    // A job that users wait for (WaitBench.cpp). The grid takes 10.4 GB.
    if (availableMemory() > size_t{12'000'000'000})
        once(add("wait/shell/2048", [=](auto& state) { velocity(state, flow, {.voxel = 2.0 / 2048}); }));
    // The same shell as the mask of a level set's narrow band, which is made when needed.
    once(add("shell_mask/512", [=](auto& state) {
        constexpr float kVoxelSize = 2.0F / 512, kHalfWidth = 0.025F / kVoxelSize;
        const auto mask =
            openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(0.975F, openvdb::Vec3f(0), kVoxelSize, kHalfWidth);
        velocity(state, flow, {.mask = mask});
    }));
}

} // namespace

void registerGrid() {
    addDense();
    once(add("fill/constant", fill));
    once(add("ax/curlsimplexnoise", curlSimplexNoise));
    addWalls();
    addShells();
}

} // namespace curlew::bench
