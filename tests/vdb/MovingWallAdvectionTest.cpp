// SPDX-License-Identifier: Apache-2.0
// Grids and level sets that a flow with a moving wall carries (vdb/GridAdvection.h, vdb/LevelSetAdvection.h).
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/track/FlowMap.h"
#include "curlew/vdb/GridAdvection.h"
#include "curlew/vdb/LevelSetAdvection.h"
#include "support/FiniteDifference.h"
#include "support/MovingPoints.h"
#include "support/Points.h"

#include <openvdb/tools/LevelSetMeasure.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <openvdb/tools/LevelSetUtil.h>

using namespace curlew;
using namespace curlew::test;

namespace {

constexpr double kRadius = 0.4, kWidth = 0.2, kSpeed = 2, kTime = 0.2, kVoxel = 0.025;

/// A sphere that moves along x, or one that grows by as much, in slow air.
Flow flowAt(double t, bool grows) {
    const Sdf sphere =
        grows ? sphereSdf(kRadius + kSpeed * t) : placed(sphereSdf(kRadius), Placement{.offset = {{kSpeed * t, 0, 0}}});
    const Wall wall{.sdf = sphere, .side = Side::outside, .width = kWidth};
    return Flow(0.02 * noiseField<Psrd3>({.alpha = t, .seed = 1}), bounded(noiseField<Psrd3>({.seed = 2}), wall),
                Domain::of(wall, 0.8));
}
FlowInTime around(bool grows) {
    return FlowInTime([grows](double t) { return flowAt(t, grows); });
}

/// A level set of a ball in front of the sphere, off its axis.
openvdb::FloatGrid::Ptr ball() {
    return openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(0.1f, {0.53f, 0.15f, 0.1f},
                                                                    static_cast<float>(kVoxel), 3.0f);
}
openvdb::FloatGrid::Ptr fog() {
    const auto grid = ball();
    openvdb::tools::sdfToFogVolume(*grid);
    return grid;
}

struct Mass {
    double total = 0, inWall = 0;
    Vec3d middle;
};

/// Sums up the values of a grid, and those in the wall at a time.
Mass massOf(const openvdb::FloatGrid& grid, double t, bool grows) {
    Mass mass;
    const ScalarField distance = flowAt(t, grows).domain().wall->sdf.distance;
    for (auto value = grid.cbeginValueOn(); value; ++value) {
        const auto p = grid.indexToWorld(value.getCoord());
        const Vec3d x{{p[0], p[1], p[2]}};
        const auto q = static_cast<double>(*value);
        mass.total += q;
        mass.middle += x * q;
        if (distance.at<0>(x).value < 0) mass.inWall += q;
    }
    mass.middle *= 1 / mass.total;
    return mass;
}

} // namespace

TEST_CASE("advectGrid: a moving wall pushes fog and does not pass through it", "[vdb]") {
    const bool grows = GENERATE(false, true);
    const auto start = fog();
    const Mass before = massOf(*start, 0, grows), passed = massOf(*start, kTime, grows);
    CHECK(before.inWall == 0);
    REQUIRE(passed.inWall > 0.9 * passed.total); // where the fog was, the wall is in the end
    const AdvectedGrid moved = advectGrid(*start, around(grows), 0, kTime, {.map = {.step = 0.02, .accuracy = 1e-5}});
    CHECK(moved.overrun == 0);
    const Mass after = massOf(dynamic_cast<const openvdb::FloatGrid&>(*moved.grid), kTime, grows);
    CAPTURE(grows, before.total, after.total, after.middle);
    CHECK(after.inWall <= 1e-3 * after.total);
    if (grows) { // along its normals, where it compresses the air
        CHECK(after.middle[0] > before.middle[0] + 0.15);
        return;
    }
    // A rigid wall keeps volumes, and the fog goes where particles go.
    CHECK(after.total == Approx(before.total).epsilon(0.05));
    std::vector<Vec3d> voxels;
    std::vector<double> masses;
    for (auto value = start->cbeginValueOn(); value; ++value) {
        const auto p = start->indexToWorld(value.getCoord());
        voxels.push_back({{p[0], p[1], p[2]}});
        masses.push_back(static_cast<double>(*value));
    }
    Points particles = particlesAt(voxels);
    advect(around(grows), particles, 0, {.time = kTime, .steps = 40, .scheme = Scheme::rk4});
    Vec3d middle;
    for (size_t k = 0; k < masses.size(); ++k) middle += position(particles, k) * (masses[k] / before.total);
    CAPTURE(middle);
    CHECK(length(middle - before.middle) > 0.2);
    CHECK(length(after.middle - middle) < kVoxel / 2);
}

TEST_CASE("FlowMap: around a moving wall points go where particles go, to second order in time", "[vdb]") {
    const bool grows = GENERATE(false, true);
    const FlowInTime flow = around(grows);
    std::vector<Vec3d> start;
    for (const Vec3d& p : randomPoints(cube(0.7), 3000, 4))
        if (const double d = length(p) - kRadius; p[0] > 0 && d > 0.02 && d < 0.25) start.push_back(p);
    REQUIRE(start.size() > 100);
    Points particles = particlesAt(start);
    advect(flow, particles, 0, {.time = kTime, .steps = 160, .scheme = Scheme::rk4});
    const auto errorIn = [&](int steps) {
        std::vector<Vec3d> points = start;
        const FlowMapResult result =
            FlowMap(flow, {.step = kTime / steps, .scheme = Scheme::rk4}).carry(points, 0, kTime);
        CHECK(result.overrun == 0);
        double sum = 0;
        for (size_t k = 0; k < points.size(); ++k) sum += length(points[k] - position(particles, k));
        return sum / static_cast<double>(points.size());
    };
    const double coarse = errorIn(10), fine = errorIn(20);
    CAPTURE(grows, coarse, fine);
    CHECK(fine < 2e-3);
    CHECK(observedOrder(coarse, fine) > 1.7);
    // And back.
    std::vector<Vec3d> back = start;
    const FlowMap map(flow, {.step = kTime / 40, .scheme = Scheme::rk4});
    map.carry(back, 0, kTime);
    map.carry(back, kTime, 0);
    Worst worst;
    for (size_t k = 0; k < back.size(); ++k) worst.see(length(back[k] - start[k]), start[k]);
    CAPTURE(worst.where);
    CHECK(worst.value < 0.01);
}

TEST_CASE("advectLevelSet: a moving wall pushes a ball and keeps its volume", "[vdb]") {
    const LevelSet start{ball(), nullptr};
    constexpr double kShort = kTime / 2; // later the ball is a sheet around the sphere, too thin for its voxels
    const ScalarField distance = flowAt(kShort, false).domain().wall->sdf.distance;
    const auto depthOf = [&](const LevelSet& levelSet) { // of the surface in the wall, in voxels
        double depth = 0;
        for (auto value = levelSet.grid->cbeginValueOn(); value; ++value) {
            const auto p = levelSet.grid->indexToWorld(value.getCoord());
            if (*value < 0) depth = std::max(depth, -distance.at<0>({{p[0], p[1], p[2]}}).value / kVoxel);
        }
        return depth;
    };
    REQUIRE(depthOf(start) > 4);
    const auto moved = advectLevelSet(start, around(false), 0, kShort, {.step = 0.02, .accuracy = 1e-5});
    CHECK(depthOf(moved.levelSet) < 0.5);
    CHECK(openvdb::tools::levelSetVolume(*moved.levelSet.grid) ==
          Approx(openvdb::tools::levelSetVolume(*start.grid)).epsilon(0.05));
    // OpenVDB's method samples u = c + w itself.
    const LevelSet weno5 = advectLevelSetWeno5(start, around(false), 0, kShort);
    CHECK(depthOf(weno5) < 1.5);
    double apart = 0;
    const Sdf exact = sdfOf(moved.levelSet);
    for (auto value = weno5.grid->cbeginValueOn(); value; ++value) {
        if (std::abs(*value) > 0.3f * static_cast<float>(kVoxel)) continue;
        const auto p = weno5.grid->indexToWorld(value.getCoord());
        apart = std::max(apart, std::abs(exact.distance.at<0>({{p[0], p[1], p[2]}}).value));
    }
    CHECK(apart < 2 * kVoxel);
}
