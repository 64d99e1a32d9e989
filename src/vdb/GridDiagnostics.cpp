// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/GridDiagnostics.h"

#include "curlew/base/Parallel.h"
#include "curlew/track/Advect.h"
#include "curlew/track/Scatter.h"
#include "curlew/vdb/Openvdb.h"

#include <openvdb/tools/GridOperators.h>
#include <openvdb/tools/VelocityFields.h>

namespace curlew {

GridDiagnostics diagnoseGrid(const openvdb::Vec3SGrid& velocity, const std::optional<Wall>& wall) {
    const bool staggered = velocity.getGridClass() == openvdb::GRID_STAGGERED;
    const auto divergence = openvdb::tools::divergence(velocity);
    const double voxel = velocity.voxelSize()[0];
    const auto active = velocity.getConstUnsafeAccessor();
    const auto surrounded = [&](const openvdb::Coord& ijk) {
        for (int axis = 0; axis < 3; ++axis) {
            openvdb::Coord step(0);
            step[axis] = 1;
            if (!active.isValueOn(ijk + step) || (!staggered && !active.isValueOn(ijk - step))) return false;
        }
        return true;
    };
    constexpr double kOnWall = 1e-6; // voxels
    const auto isBeyondWall = [&](const openvdb::Coord& ijk) {
        const auto p = velocity.indexToWorld(ijk);
        return beyondWall(wall->side, wall->sdf.distance.at<0>(Vec3d{{p[0], p[1], p[2]}}).value) > -kOnWall * voxel;
    };
    constexpr double kRounding = 1e-7; // of the velocity, per voxel
    GridDiagnostics check;
    double speeds = 0, interior = 0, overall = 0;
    for (auto leaf = divergence->tree().cbeginLeaf(); leaf; ++leaf)
        for (auto value = leaf->cbeginValueOn(); value; ++value) {
            const openvdb::Coord ijk = value.getCoord();
            const double squared = static_cast<double>(*value) * static_cast<double>(*value);
            const double speed2 = openvdb::Vec3d(active.getValue(ijk)).lengthSqr();
            speeds += speed2;
            check.maxSpeed = std::max(check.maxSpeed, std::sqrt(speed2));
            ++check.voxels;
            if (staggered && wall && squared * voxel * voxel > kRounding * kRounding * speed2 && isBeyondWall(ijk)) {
                ++check.beyondWall;
                continue;
            }
            overall += squared;
            if (!surrounded(ijk)) continue;
            ++check.interior;
            interior += squared;
        }
    if (check.voxels == 0 || !(speeds > 0)) return check;
    check.rmsSpeed = std::sqrt(speeds / static_cast<double>(check.voxels));
    const double unit = voxel / check.rmsSpeed;
    if (const size_t counted = check.voxels - check.beyondWall; counted > 0)
        check.divergenceOverall = std::sqrt(overall / static_cast<double>(counted)) * unit;
    if (check.interior > 0) check.divergence = std::sqrt(interior / static_cast<double>(check.interior)) * unit;
    return check;
}

namespace {

template <bool Staggered>
void advectOnGrid(const openvdb::Vec3SGrid& velocity, double dt, int steps, Points& p, const Monitor& monitor) {
    parallelFor(
        p.size(), 16,
        [&](size_t begin, size_t end) {
            const openvdb::tools::VelocityIntegrator<openvdb::Vec3SGrid, Staggered> integrator(velocity);
            for (size_t k = begin; k < end; ++k) {
                openvdb::Vec3d x(p.x[k], p.y[k], p.z[k]);
                for (int n = 0; n < steps; ++n) integrator.template rungeKutta<4>(static_cast<float>(dt), x);
                p.x[k] = x[0];
                p.y[k] = x[1];
                p.z[k] = x[2];
            }
        },
        monitor);
}

} // namespace

TrackDiagnostics diagnoseTracks(const Flow& flow, const openvdb::Vec3SGrid& velocity, int steps, size_t points,
                                const Monitor& monitor) {
    constexpr uint64_t kSeed = 0x636865636d;
    const double speed = rmsOf(flow).speed;
    if (!(speed > 0)) throw ValueError("the flow is zero everywhere");
    TrackDiagnostics check{.steps = steps, .time = 0.25 * velocity.voxelSize()[0] / speed * steps};
    Points ours = scatter(flow.domain(), points, kSeed);
    advect(flow, ours, {.time = 0, .steps = 1}); // sets their tracks
    Points theirs = ours;
    advect(flow, ours, {.time = check.time, .steps = steps}, monitor);
    const bool staggered = velocity.getGridClass() == openvdb::GRID_STAGGERED;
    (staggered ? advectOnGrid<true> : advectOnGrid<false>)(velocity, check.time / steps, steps, theirs, monitor);
    check.field = diagnoseParticles(flow, ours);
    check.onGrid = diagnoseParticles(flow, theirs);
    return check;
}

} // namespace curlew
