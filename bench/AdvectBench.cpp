// SPDX-License-Identifier: Apache-2.0
// Advection of particles: ours along the field itself, OpenVDB's through a grid of the field.

#include "Cases.h"
#include "Inputs.h"
#include "curlew/base/Parallel.h"
#include "curlew/track/Advect.h"
#include "curlew/track/Scatter.h"
#include "curlew/vdb/VelocityGrid.h"

#include <fmt/format.h>
#include <openvdb/points/PointAdvect.h>
#include <openvdb/points/PointConversion.h>

#include <array>
#include <cmath>
#include <limits>
#include <string_view>

namespace curlew::bench {

namespace {

namespace points = openvdb::points;

constexpr size_t kParticles = 20000;
constexpr int kSteps = 200;
constexpr double kTravel = 3.4;   ///< Distance that a particle travels at the rms speed, which is 1; equal to the time.
constexpr double kFrequency = 2;  ///< Frequency of the noises.
constexpr double kScattered = 1;  ///< Half edge of the cube in which the particles start.
constexpr double kCovered = 2;    ///< Half edge of the cube that OpenVDB's grid covers; few particles leave it.
constexpr int kVelocityDim = 128; ///< Voxels of that grid along an edge.

Flow driftingFlow() {
    return withSpeed(freeFlow({.box = Box{}.padded(kCovered), .wall = std::nullopt}, kFrequency), 1);
}
Points scattered(size_t count) { return scatter({.box = Box{}.padded(kScattered), .wall = std::nullopt}, count, 1); }

// ---- Ours

void setDrift(benchmark::State& state, double f, double g) {
    state.counters["drift_f"] = f;
    state.counters["drift_g"] = g;
}

void advection(benchmark::State& state, size_t count, int steps, Reprojection method, int threads) {
    const ThreadLimit limit(threads);
    const Flow flow = driftingFlow();
    const Points start = scattered(count);
    AdvectResult result;
    for (auto _ : state) {
        Points particles = start;
        result = advect(flow, particles,
                        {.time = kTravel * steps / kSteps, .steps = steps, .reprojection = {.method = method}});
    }
    state.SetItemsProcessed(state.iterations() * steps * static_cast<int64_t>(count));
    setDrift(state, result.residual[0], result.residual[1]);
    state.counters["not_converged"] = static_cast<double>(result.notConverged);
}

// ---- Ours in a mesh

/// Moves particles through the noises of two octaves by RK4: inside the mesh, or without its wall.
void advectInMesh(benchmark::State& state, bool walled) {
    constexpr int kCount = 20000, kMeshSteps = 100;
    const ThreadLimit limit(1);
    const Flow flow = flowInSpot(walled);
    const Points start = scatter(insideSpot(), kCount, 1);
    AdvectResult result;
    for (auto _ : state) {
        Points particles = start;
        result = advect(flow, particles, {.time = 1, .steps = kMeshSteps, .scheme = Scheme::rk4});
    }
    state.SetItemsProcessed(state.iterations() * kMeshSteps * kCount);
    setDrift(state, result.residual[0], result.residual[1]);
    state.counters["outside"] = static_cast<double>(result.outside);
    state.counters["substeps"] = static_cast<double>(result.substeps) / (kMeshSteps * kCount);
}

// ---- OpenVDB's

using PointGrid = points::PointDataGrid;

/// The id attribute for OpenVDB's point tools: the index of each point.
struct Indices {
    using value_type = int32_t;
    void get(value_type& id, openvdb::Index64 n, openvdb::Index) const { id = static_cast<int32_t>(n); }
};

/// Converts the particles to OpenVDB points, about 8 per voxel as in its own tools. Adds ids if the points must be
/// identified later.
PointGrid::Ptr pointGrid(const Points& particles, bool withIds) {
    std::vector<openvdb::Vec3f> positions;
    for (size_t i = 0; i < particles.size(); ++i)
        positions.emplace_back(openvdb::Vec3d(particles.x[i], particles.y[i], particles.z[i]));
    const points::PointAttributeVector<openvdb::Vec3f> wrapped(positions);
    const auto transform = openvdb::math::Transform::createLinearTransform(points::computeVoxelSize(wrapped, 8));
    const auto index = openvdb::tools::createPointIndexGrid<openvdb::tools::PointIndexGrid>(wrapped, *transform);
    const auto grid = points::createPointDataGrid<points::NullCodec, PointGrid>(*index, wrapped, *transform);
    if (withIds) {
        points::appendAttribute<int32_t>(grid->tree(), "id");
        points::populateAttribute(grid->tree(), index->tree(), "id", Indices{});
    }
    return grid;
}

void advectInCalls(PointGrid& grid, const openvdb::Vec3SGrid& velocity, int calls) {
    constexpr openvdb::Index kRungeKutta4 = 4;
    for (int call = 0; call < calls; ++call)
        points::advectPoints(grid, velocity, kRungeKutta4, kTravel / kSteps,
                             static_cast<openvdb::Index>(kSteps / calls));
}

/// Returns the positions of points with ids, in the order of these; NaN for points that are lost.
std::vector<Vec3d> positionsOf(const PointGrid& grid, size_t count) {
    constexpr double kLost = std::numeric_limits<double>::quiet_NaN();
    std::vector<Vec3d> positions(count, Vec3d{{kLost, kLost, kLost}});
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
        const points::AttributeHandle<openvdb::Vec3f> position(leaf->constAttributeArray("P"));
        const points::AttributeHandle<int32_t> id(leaf->constAttributeArray("id"));
        for (auto n = leaf->beginIndexOn(); n; ++n) {
            const auto p = grid.transform().indexToWorld(openvdb::Vec3d(position.get(*n)) + n.getCoord().asVec3d());
            positions[static_cast<size_t>(id.get(*n))] = {{p[0], p[1], p[2]}};
        }
    }
    return positions;
}

/// Measures the drift of the points from their values of f and g, as root mean squares relative to those of f and g.
/// Ignores points that have left the velocity grid.
void measureDrift(benchmark::State& state, const Flow& flow, const Points& start, const PointGrid& grid) {
    double f2 = 0, g2 = 0;
    size_t count = 0;
    const std::vector<Vec3d> positions = positionsOf(grid, start.size());
    for (size_t k = 0; k < start.size(); ++k) {
        const Vec3d now = positions[k], then = start.position(k);
        if (!flow.domain().box.contains(now)) continue;
        const double df = flow.f().at<0>(now).value - flow.f().at<0>(then).value;
        const double dg = flow.g().at<0>(now).value - flow.g().at<0>(then).value;
        f2 += df * df;
        g2 += dg * dg;
        ++count;
    }
    const auto rms = rmsOf(flow).potentials;
    const auto points = static_cast<double>(count);
    setDrift(state, std::sqrt(f2 / points) / rms[0], std::sqrt(g2 / points) / rms[1]);
    state.counters["left"] = static_cast<double>(start.size() - count);
}

void advectPoints(benchmark::State& state, int calls, Layout layout) {
    const ThreadLimit limit(1);
    const Flow flow = driftingFlow();
    const Points start = scattered(kParticles);
    const auto velocity = velocityGrid(flow, {.dim = kVelocityDim, .layout = layout});
    const auto timed = pointGrid(start, false);
    for (auto _ : state) advectInCalls(*timed, *velocity, calls);
    state.SetItemsProcessed(state.iterations() * kSteps * static_cast<int64_t>(kParticles));
    const auto measured = pointGrid(start, true);
    advectInCalls(*measured, *velocity, calls);
    measureDrift(state, flow, start, *measured);
}

// ---- Cost against accuracy: a particle's whole path is an item

constexpr size_t kPaths = 12000;

/// Returns the ends of the paths, to about 1e-9: rk45 has an error of 2e-7 at an accuracy of 1e-8, and a sixth of it
/// for each further digit.
const std::vector<Vec3d>& exactEnds() {
    static const std::vector<Vec3d> ends = [] {
        Points particles = scattered(kPaths);
        advect(driftingFlow(), particles, {.time = kTravel, .reprojection = {.tolerance = 1e-12}, .accuracy = 1e-11});
        std::vector<Vec3d> positions;
        for (size_t k = 0; k < kPaths; ++k) positions.push_back(particles.position(k));
        return positions;
    }();
    return ends;
}

/// Sets the counter from which report.py draws the picture: the mean distance from exactEnds().
template <class Position>
void setError(benchmark::State& state, const Position& position) {
    double sum = 0;
    size_t count = 0;
    for (size_t k = 0; k < kPaths; ++k) {
        const double off = length(position(k) - exactEnds()[k]);
        if (std::isnan(off)) continue;
        sum += off;
        ++count;
    }
    state.counters["error"] = sum / static_cast<double>(count);
    state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(kPaths));
}

void accuracyOfAdvect(benchmark::State& state, const AdvectOptions& options) {
    const ThreadLimit limit(1);
    const Flow flow = driftingFlow();
    const Points start = scattered(kPaths);
    Points particles;
    for (auto _ : state) {
        particles = start;
        advect(flow, particles, options);
    }
    setError(state, [&](size_t k) { return particles.position(k); });
}

/// The time to make the velocity grid is not included.
void accuracyOfAdvectPoints(benchmark::State& state, Layout layout, int dim) {
    const ThreadLimit limit(1);
    const auto velocity = velocityGrid(driftingFlow(), {.dim = dim, .layout = layout});
    const auto grid = pointGrid(scattered(kPaths), true);
    for (auto _ : state) advectInCalls(*grid, *velocity, 1);
    const std::vector<Vec3d> positions = positionsOf(*grid, kPaths);
    setError(state, [&](size_t k) { return positions[k]; });
}

/// Adds the cases of all schemes. Names are "accuracy/CURVE/POINT".
void addSchemes(Reprojection method, std::string_view suffix) {
    constexpr std::array kEqual{std::pair{"euler", Scheme::euler}, std::pair{"midpoint", Scheme::midpoint},
                                std::pair{"rk4", Scheme::rk4}};
    constexpr std::array kAdaptive{std::pair{"rk23", Scheme::bogackiShampine},
                                   std::pair{"rk45", Scheme::dormandPrince}};
    const auto addCase = [&](std::string_view scheme, const std::string& point, AdvectOptions options) {
        options.time = kTravel;
        options.reprojection.method = method;
        once(add(fmt::format("accuracy/{}{}/{}", scheme, suffix, point),
                 [=](auto& state) { accuracyOfAdvect(state, options); }));
    };
    for (const auto& [name, scheme] : kEqual)
        for (const int steps : {12, 25, 50, 100, 200, 400, 800})
            addCase(name, std::to_string(steps), {.steps = steps, .scheme = scheme});
    for (const auto& [name, scheme] : kAdaptive)
        for (const double accuracy : {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8})
            addCase(name, fmt::format("{:.0e}", accuracy), {.scheme = scheme, .accuracy = accuracy});
}

void addAccuracy() {
    addSchemes(Reprojection::gaussNewton, "");
    for (const auto& [name, layout] :
         {std::pair{"OpenVDB", Layout::collocated}, std::pair{"OpenVDB_staggered", Layout::staggered}})
        for (const int dim : {64, 128, 256, 512})
            once(add(fmt::format("accuracy/{}/{}", name, dim),
                     [layout = layout, dim](auto& state) { accuracyOfAdvectPoints(state, layout, dim); }));
    addSchemes(Reprojection::none, "_not_reprojected");
}

} // namespace

void registerAdvect() {
    constexpr std::pair<const char*, Reprojection> kMethods[] = {
        {"none", Reprojection::none}, {"newton", Reprojection::newton}, {"gauss_newton", Reprojection::gaussNewton}};
    for (const auto& [name, method] : kMethods)
        once(add(fmt::format("advect/{}/1thread", name), [method = method](auto& state) {
            advection(state, kParticles, kSteps, method, 1);
        }))->UseRealTime();
    once(add("advect/gauss_newton/2threads", [](auto& state) {
        advection(state, kParticles, kSteps, Reprojection::gaussNewton, 2);
    }))->UseRealTime();
    for (const size_t count : {size_t{4000}, size_t{16000}, size_t{64000}})
        once(add(fmt::format("scale/particles/{}", count),
                 [=](auto& state) { advection(state, count, 20, Reprojection::gaussNewton, 1); }));
    for (const bool walled : {false, true})
        once(add(walled ? "advect/mesh/1thread" : "advect/mesh_without_wall/1thread", [=](auto& state) {
            advectInMesh(state, walled);
        }))->UseRealTime();
    once(add("advect_points/step_a_call", [](auto& state) { advectPoints(state, kSteps, Layout::collocated); }));
    once(add("advect_points/one_call", [](auto& state) { advectPoints(state, 1, Layout::collocated); }));
    once(add("advect_points/one_call_staggered", [](auto& state) { advectPoints(state, 1, Layout::staggered); }));
    addAccuracy();
}

} // namespace curlew::bench
