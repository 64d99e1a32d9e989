// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/Algebra.h"
#include "curlew/flow/Domain.h"
#include "curlew/math/Fade.h"
#include "curlew/math/Rotation.h"
#include "curlew/track/WallMotion.h"
#include "support/Points.h"

#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

constexpr double kWidth = 0.3;

Wall wallOf(const Sdf& sdf, Side side = Side::outside) { return {.sdf = sdf, .side = side, .width = kWidth}; }

Wall placedWall(const Sdf& sdf, const Vec3d& offset, const Vec3d& rotate = {}, Side side = Side::outside) {
    return wallOf(placed(sdf, Placement{.offset = offset, .rotate = rotate}), side);
}

Sdf ellipsoidish() { return boxSdf({{1.2, 0.8, 0.6}}, 0.25); }

std::vector<Vec3d> allowedPoints(const Wall& wall, size_t count) {
    std::vector<Vec3d> points;
    for (uint64_t k = 0; points.size() < count && k < 400 * count; ++k)
        if (const Vec3d p = randomPoint(cube(1.5), 1, k);
            beyondWall(wall.side, wall.sdf.distance.at<0>(p).value) < -1e-6)
            points.push_back(p);
    REQUIRE(points.size() == count);
    return points;
}

size_t countBeyond(const Wall& wall, const std::vector<Vec3d>& points) {
    size_t beyond = 0;
    for (const Vec3d& p : points) beyond += !(beyondWall(wall.side, wall.sdf.distance.at<0>(p).value) < 0);
    return beyond;
}

/// Computes det(∂x(1)/∂x(0)) by central differences.
double determinantAt(const WallMotion& motion, const Vec3d& p, double h) {
    std::vector<Vec3d> around;
    for (int axis = 0; axis < 3; ++axis)
        for (const double sign : {-1.0, 1.0}) {
            around.push_back(p);
            around.back()[axis] += sign * h;
        }
    motion.carry(around);
    const Vec3d x = around[1] - around[0], y = around[3] - around[2], z = around[5] - around[4];
    return dot(x, cross(y, z)) / (8 * h * h * h);
}

} // namespace

TEST_CASE("WallMotion: a wall at rest moves nothing", "[track]") {
    const Wall wall = placedWall(ellipsoidish(), {{0.1, 0, 0}}, {{10, 20, 30}});
    const WallMotion motion(wall, placedWall(ellipsoidish(), {{0.1, 0, 0}}, {{10, 20, 30}}), cube(1.5));
    CHECK(motion.still());
    auto points = allowedPoints(wall, 200);
    const auto start = points;
    CHECK(motion.carry(points) == 0);
    CHECK(points == start);
}

TEST_CASE("WallMotion: points at the wall move with it and those beyond the layer stay", "[track]") {
    const auto side = GENERATE(Side::outside, Side::inside, Side::both);
    const auto [offset, rotate] = GENERATE(table<Vec3d, Vec3d>({{{{0.2, -0.1, 0.15}}, {}},
                                                                {{}, {{0, 25, 0}}},
                                                                {{{0.1, 0.1, 0}}, {{15, 0, 20}}},
                                                                {{{0.02, 0, 0.01}}, {{0, 0, 180}}}}));
    const Placement now{.offset = {{0.1, 0, 0}}, .rotate = {{10, 20, 30}}};
    const Sdf shape = placed(ellipsoidish(), now);
    const Wall from = wallOf(shape, side);
    const Wall to = wallOf(placed(shape, Placement{.offset = offset, .rotate = rotate}), side);
    const WallMotion motion(from, to, cube(1.5));
    CAPTURE(static_cast<int>(side), offset, rotate);
    CHECK_FALSE(motion.still());
    REQUIRE(motion.rigid());
    const Matrix3 turn = rotationOf(Placement{.rotate = rotate});

    std::vector<Vec3d> points = side == Side::both ? randomPoints(cube(1.2), 1000, 3) : allowedPoints(from, 1000);
    std::vector<Vec3d> start = points;
    CHECK(motion.carry(points) == 0);
    size_t crossed = 0, stayed = 0;
    for (size_t k = 0; k < points.size(); ++k) {
        const double before = from.sdf.distance.at<0>(start[k]).value;
        crossed += (before < 0) != (to.sdf.distance.at<0>(points[k]).value < 0);
        const bool far = std::abs(before) > kWidth + length(offset) + 2.2 * length(rotate) * std::numbers::pi / 180;
        if (!far) continue;
        ++stayed;
        if (length(points[k] - start[k]) > 1e-7) FAIL("moved, although beyond the layer");
    }
    CHECK(crossed == 0);
    if (side == Side::outside && rotate == Vec3d{}) CHECK(stayed > 100);

    // Points close to the wall, found by descending the distance.
    std::vector<Vec3d> close;
    for (Vec3d p : start) {
        const double d = from.sdf.distance.at<0>(p).value;
        if (std::abs(d) > 0.2) continue;
        for (int k = 0; k < 5; ++k) {
            const auto jet = from.sdf.distance.at<1>(p);
            p += jet.gradient * ((std::copysign(1e-4, d) - jet.value) / dot(jet.gradient, jet.gradient));
        }
        close.push_back(p);
    }
    REQUIRE(close.size() > 20);
    const auto atWall = close;
    CHECK(motion.carry(close) == 0);
    Worst worst;
    for (size_t k = 0; k < close.size(); ++k) worst.see(length(close[k] - (turn * atWall[k] + offset)), atWall[k]);
    CAPTURE(worst.where);
    CHECK(worst.value < 1e-4);
}

TEST_CASE("WallMotion: a rigid wall preserves volumes", "[track]") {
    const Wall from = wallOf(sphereSdf(0.5));
    const Placement moved{.offset = {{0.15, 0.05, 0}}, .rotate = {{0, 20, 0}}};
    const WallMotion motion(from, wallOf(placed(sphereSdf(0.5), moved)), cube(1.5));
    REQUIRE(motion.rigid());
    const auto worstAt = [&](double h) {
        double worst = 0;
        for (const Vec3d& p : randomPoints(cube(0.8), 200, 5))
            if (const double d = length(p) - 0.5; d > 0.02 && d < 0.28)
                worst = std::max(worst, std::abs(determinantAt(motion, p, h) - 1));
        return worst;
    };
    const double worst = worstAt(1e-3);
    CAPTURE(worst, worstAt(2e-3));
    CHECK(worst < 2e-3);
    // The remaining error is that of the differences, not of the flow, since it depends on their step.
    CHECK(worstAt(4e-3) > 4 * worst);
}

TEST_CASE("WallMotion: a deforming wall pushes points along its normals", "[track]") {
    const Wall from = wallOf(sphereSdf(0.5)), to = wallOf(sphereSdf(0.6));
    const WallMotion motion(from, to, cube(1.5));
    CHECK_FALSE(motion.still());
    CHECK_FALSE(motion.rigid());
    auto points = allowedPoints(from, 1000);
    const auto start = points;
    CHECK(motion.carry(points) == 0);
    CHECK(countBeyond(to, points) == 0);
    CHECK(countBeyond(to, start) > 10); // the wall has moved over that many points
    for (size_t k = 0; k < points.size(); ++k) {
        const double before = length(start[k]), after = length(points[k]);
        if (before < 0.501) CHECK(after - before == Approx(0.1).margin(2e-3));
        if (before > 0.9) CHECK(after == before);
        // Points move outward along radii.
        CHECK(length(cross(start[k], points[k])) < 1e-9);
        CHECK(after >= before - 1e-12);
    }
    SECTION("reversed") {
        CHECK(WallMotion(to, from, cube(1.5)).carry(points) == 0);
        Worst worst;
        for (size_t k = 0; k < points.size(); ++k) worst.see(length(points[k] - start[k]), start[k]);
        CAPTURE(worst.where);
        CHECK(worst.value < 2e-3);
    }
    SECTION("shrinking container") {
        const Wall big = wallOf(sphereSdf(0.6), Side::inside), small = wallOf(sphereSdf(0.5), Side::inside);
        auto inner = allowedPoints(big, 500);
        CHECK(countBeyond(small, inner) > 10);
        CHECK(WallMotion(big, small, cube(1.5)).carry(inner) == 0);
        CHECK(countBeyond(small, inner) == 0);
    }
}

TEST_CASE("WallMotion: points on the wall or in a gap that closes stay outside", "[track]") {
    SECTION("on the wall, as close as classify() allows") {
        const Wall from = wallOf(sphereSdf(0.5)), to = wallOf(sphereSdf(0.53));
        std::vector<Vec3d> points;
        for (const Vec3d& p : randomPoints(cube(1), 2000, 5)) {
            const Vec3d direction = p * (1 / length(p));
            const double sum = std::abs(direction[0]) + std::abs(direction[1]) + std::abs(direction[2]);
            points.push_back(direction * (0.5 + 0x1p-23 * 0.501 * sum));
        }
        CHECK(WallMotion(from, to, cube(1.5)).carry(points) == 0);
        CHECK(countBeyond(to, points) == 0);
    }
    SECTION("a gap of 0.2 between two spheres closes to 0.02") {
        const auto pair = [](double gap) {
            const double x = 0.4 + gap / 2;
            return wallOf(unite(placed(sphereSdf(0.4), Placement{.offset = {{x, 0, 0}}}),
                                placed(sphereSdf(0.4), Placement{.offset = {{-x, 0, 0}}}), 0));
        };
        const Wall from = pair(0.2), to = pair(0.02);
        std::vector<Vec3d> points;
        for (const Vec3d& p : randomPoints(cube(0.1), 4000, 6))
            if (from.sdf.distance.at<0>(p).value > 1e-6) points.push_back(p);
        REQUIRE(points.size() > 2000);
        REQUIRE(countBeyond(to, points) > 1000);
        CHECK(WallMotion(from, to, cube(1.5)).carry(points) == 0);
        CHECK(countBeyond(to, points) == 0);
    }
}

TEST_CASE("WallMotion: points beyond a moving wall stay in place", "[track]") {
    const Wall from = wallOf(sphereSdf(0.5)), to = placedWall(sphereSdf(0.5), {{0.1, 0, 0}});
    std::vector<Vec3d> points{{{0, 0, 0}}, {{0.45, 0, 0}}};
    const auto start = points;
    CHECK(WallMotion(from, to, cube(1.5)).carry(points) == 0);
    CHECK(points == start);
}

TEST_CASE("WallMotion: does not depend on threads or other points", "[track]") {
    const Wall from = wallOf(sphereSdf(0.5));
    for (const Wall& to : {placedWall(sphereSdf(0.5), {{0.1, 0, 0}}), wallOf(sphereSdf(0.55))}) {
        const WallMotion motion(from, to, cube(1.5));
        auto points = allowedPoints(from, 500);
        auto alone = points;
        {
            const ThreadLimit limit(1);
            motion.carry(points);
        }
        auto again = alone;
        motion.carry(again);
        CHECK(again == points);
        std::reverse(alone.begin(), alone.end());
        motion.carry(alone);
        std::reverse(alone.begin(), alone.end());
        CHECK(alone == points);
    }
}

TEST_CASE("WallMotion: a wall cannot change its side", "[track]") {
    CHECK_THROWS_AS(WallMotion(wallOf(sphereSdf(1)), wallOf(sphereSdf(1), Side::inside), cube(2)), ValueError);
}

namespace {

const Vec3d kSpin{{0.4, -0.3, 1.2}}; // radians per second

/// A sphere that rotates, described by the velocity of its surface instead of a pose, with a normal part that must not
/// matter.
Wall spinning(double radius = 0.5) {
    Wall wall = wallOf(sphereSdf(radius));
    const auto component = [](const Vec3d& gradient) { return rampField(gradient); };
    const Vec3d w = kSpin;
    wall.sdf.surfaceVelocity = {component({{2, -w[2], w[1]}}), component({{w[2], 2, -w[0]}}),
                                component({{-w[1], w[0], 2}})};
    return wall;
}

} // namespace

TEST_CASE("WallMotion: a surface that slides along itself carries the points beside it", "[track]") {
    const double seconds = GENERATE(0.3, -0.3);
    const WallMotion motion(spinning(), spinning(), cube(1.5), seconds);
    CHECK_FALSE(motion.still());
    CHECK(motion.maxChange() == 0);
    CHECK(WallMotion(spinning(), spinning(), cube(1.5)).still()); // without a time, nothing is known to move
    auto points = allowedPoints(spinning(), 500);
    const auto start = points;
    CHECK(motion.carry(points) == 0);
    Worst worst;
    for (size_t k = 0; k < points.size(); ++k) {
        const double distance = length(start[k]) - 0.5, angle = seconds * length(kSpin);
        const double share = 1 - quinticFade(distance / kWidth).value;
        worst.see(length(points[k] - rotationBy(kSpin * (angle * share / length(kSpin))) * start[k]), start[k]);
    }
    CAPTURE(worst.where);
    CHECK(worst.value < 1e-6); // RK4 in 64 steps
}

TEST_CASE("WallMotion: a surface that grows and slides does both", "[track]") {
    const WallMotion motion(spinning(0.5), spinning(0.6), cube(1.5), 0.5);
    std::vector<Vec3d> points;
    for (const Vec3d& p : randomPoints(cube(1), 50, 4)) points.push_back(p * (0.5001 / length(p)));
    const auto start = points;
    CHECK(motion.carry(points) == 0);
    for (size_t k = 0; k < points.size(); ++k)
        CHECK(length(points[k] - rotationBy(kSpin * 0.5) * (start[k] * (0.6 / 0.5))) < 1e-3);
}
