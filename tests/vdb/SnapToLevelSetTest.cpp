// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/Scatter.h"
#include "curlew/vdb/SnapToLevelSet.h"
#include "support/Catch.h"
#include "support/Meshes.h"
#include "support/Points.h"

#include <openvdb/tools/LevelSetSphere.h>

using namespace curlew;
using curlew::test::spot;

namespace {

LevelSet ball(double voxel) {
    return {.grid = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(1, openvdb::Vec3f(0),
                                                                             static_cast<float>(voxel)),
            .mesh = nullptr};
}

} // namespace

TEST_CASE("snapToLevelSet: reaches the nearest surface point from any distance", "[vdb]") {
    const LevelSet levelSet = ball(0.05);
    const Sdf sdf = sdfOf(levelSet);
    Points points = scatter({.box = Box{}.padded(3), .wall = {}}, 3000, 1);
    points.vx = points.vy = points.vz = std::vector<float>(3000, 1.0F);
    const Points start = points;
    const SnapResult result = snapToLevelSet(levelSet, points, 100, 1e-9);
    CHECK(result.points == 3000);
    CHECK(result.missed == 0);
    CHECK_FALSE(points.hasVelocity());
    double moved = 0;
    for (size_t k = 0; k < 3000; ++k) {
        const Vec3d from = start.position(k), to = points.position(k);
        CAPTURE(k, from, to);
        REQUIRE(std::abs(sdf.distance.at<0>(to).value) <= 1e-9);
        // The nearest point of a ball is on the ray from its centre. The normals of the spline's ball are off by
        // O(h^3), which matters more if a point begins closer to the centre.
        const double begun = length(from);
        if (begun > 0.3) REQUIRE(length(to - from * (1 / begun)) < 2e-3 * std::max(1.0, 1 / begun));
        moved += length(to - from);
    }
    CHECK(result.moved == Approx(moved / 3000).epsilon(1e-9));
}

TEST_CASE("snapToLevelSet: reaches the surface over creases", "[vdb]") {
    const LevelSet levelSet = meshToLevelSet(std::make_shared<const Mesh>(spot()), {.dim = 96});
    const ScalarField distance = sdfOf(levelSet).distance;
    Points points = scatter({.box = Box{}.padded(1), .wall = {}}, 10000, 1); // three of them went astray
    const SnapResult result = snapToLevelSet(levelSet, points, 100, 1e-9);
    CHECK(result.missed == 0);
    for (size_t k = 0; k < points.size(); ++k) REQUIRE(std::abs(distance.at<0>(points.position(k)).value) <= 1e-9);
}

TEST_CASE("snapToLevelSet: points beyond the reach stay in place", "[vdb]") {
    Points points = Points::at({{{0, 0, 3}}, {{0, 0, 1.2}}, {{0, 0.9, 0}}});
    const SnapResult result = snapToLevelSet(ball(0.05), points, 0.3, 1e-9);
    CHECK(result.missed == 1);
    CHECK(points.z[0] == 3);
    CHECK(points.z[1] == Approx(1).margin(1e-3));
    CHECK(points.y[2] == Approx(1).margin(1e-3));
    CHECK_THROWS_AS(snapToLevelSet(ball(0.05), points, 0, 1e-9), ValueError);
}
