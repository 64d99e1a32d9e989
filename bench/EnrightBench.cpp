// SPDX-License-Identifier: Apache-2.0
// Enright's test: a sphere is stretched to a sheet and back. Ours uses the flow map, OpenVDB's its level set advection
// with its own velocity field.

#include "Cases.h"
#include "curlew/base/Parallel.h"
#include "curlew/flow/Flows.h"
#include "curlew/vdb/LevelSetAdvection.h"

#include <fmt/format.h>
#include <openvdb/tools/LevelSetAdvect.h>
#include <openvdb/tools/LevelSetMeasure.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <cmath>

namespace curlew::bench {

namespace {

constexpr double kPeriod = 3, kRadius = 0.15, kCenter = 0.35;
constexpr int kSteps = 64; ///< Steps of our method in the whole period.

LevelSet sphere(int dim) {
    constexpr auto c = static_cast<float>(kCenter);
    return {openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(static_cast<float>(kRadius), {c, c, c},
                                                                     1.0f / static_cast<float>(dim)),
            nullptr};
}

double volumeChange(const LevelSet& after, const LevelSet& before) {
    return 100 * (openvdb::tools::levelSetVolume(*after.grid) / openvdb::tools::levelSetVolume(*before.grid) - 1);
}

/// Returns the mean distance, in voxels, between points of the surface (of its spline) and the sphere.
double surfaceDistance(const LevelSet& levelSet) {
    const Sdf sdf = sdfOf(widened(levelSet, 6));
    const double voxel = levelSet.voxelSize();
    double sum = 0, count = 0;
    for (auto value = levelSet.grid->cbeginValueOn(); value; ++value) {
        if (std::abs(static_cast<double>(*value)) > 0.7 * voxel) continue;
        const auto world = levelSet.grid->indexToWorld(value.getCoord());
        Vec3d p{{world[0], world[1], world[2]}};
        double left = voxel;
        for (int k = 0; k < 6; ++k) { // Newton's method
            const auto d = sdf.distance.at<1>(p);
            left = d.value;
            const double lipschitz = dot(d.gradient, d.gradient);
            if (!(lipschitz > 0.01)) break;
            p -= d.gradient * (d.value / lipschitz);
        }
        if (!(std::abs(left) < 1e-3 * voxel)) continue; // no surface point found
        sum += std::abs(length(p - Vec3d{{kCenter, kCenter, kCenter}}) - kRadius) / voxel;
        ++count;
    }
    return sum / std::max(count, 1.0);
}

/// Times the whole period and also measures the half period. `advance(start, time)` is the method under test.
template <class Advance>
void enright(benchmark::State& state, int dim, const Advance& advance) {
    const ThreadLimit limit(2);
    const LevelSet start = sphere(dim);
    LevelSet end;
    for (auto _ : state) end = advance(start, kPeriod);
    state.SetItemsProcessed(state.iterations());
    state.counters["volume_half"] = volumeChange(advance(start, kPeriod / 2), start);
    state.counters["volume_end"] = volumeChange(end, start);
    state.counters["surface_end"] = surfaceDistance(end);
}

LevelSet byOpenVdb(const LevelSet& start, double time) {
    const auto grid = start.grid->deepCopy();
    const openvdb::tools::EnrightField<float> field;
    openvdb::tools::LevelSetAdvection<openvdb::FloatGrid> advection(*grid, field);
    advection.setSpatialScheme(openvdb::math::HJWENO5_BIAS);
    advection.setTemporalScheme(openvdb::math::TVD_RK3);
    advection.setTrackerSpatialScheme(openvdb::math::HJWENO5_BIAS);
    advection.setTrackerTemporalScheme(openvdb::math::TVD_RK3);
    advection.advect(0, static_cast<float>(time));
    return {grid, nullptr};
}

LevelSet byFlowMap(const LevelSet& start, double time) {
    return advectLevelSet(start, enrightFlowInTime(kPeriod), 0, time, {.step = kPeriod / kSteps}).levelSet;
}

} // namespace

void registerEnright() {
    for (const int dim : {64, 128, 256}) {
        once(add(fmt::format("enright/{}/flowmap/2threads", dim), [=](auto& state) {
            enright(state, dim, byFlowMap);
        }))->UseRealTime();
        once(add(fmt::format("enright/{}/openvdb/2threads", dim), [=](auto& state) {
            enright(state, dim, byOpenVdb);
        }))->UseRealTime();
    }
}

} // namespace curlew::bench
