// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/math/Percentile.h"
#include "curlew/track/Advect.h"
#include "curlew/track/WallMotion.h"
#include "curlew/track/WallVelocity.h"
#include "support/FlowChecks.h"
#include "support/MovingPoints.h"
#include "support/Points.h"

#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

constexpr double kWidth = 0.3, kStep = 4e-4;

/// A rounded box that translates and rotates uniformly.
struct Motion {
    Vec3d velocity{{1, -0.5, 0.3}}, turning{{0, 0, 40}}; ///< Degrees per second about z.

    Wall at(double t, Side side = Side::outside) const {
        const Placement place{.offset = velocity * t, .rotate = turning * t};
        return {.sdf = placed(boxSdf({{1.2, 0.8, 0.6}}, 0.25), place), .side = side, .width = kWidth};
    }
    Vec3d velocityOf(const Vec3d& x, double t) const {
        const Vec3d omega = turning * (std::numbers::pi / 180);
        return velocity + cross(omega, x - velocity * t);
    }
    WallVelocity wallVelocity(double t, Side side = Side::outside) const {
        return {at(t, side), at(t + kStep, side), at(t + 2 * kStep, side), kStep, cube(1.5)};
    }
};

/// The distance from two walls at x = ±h; smooth, so that its gradient vanishes between them.
struct Gap {
    double h;
    template <int Order, class T>
    Jet<T, 3, Order> at(const Vec3d& p) const {
        Jet<T, 3, Order> square(static_cast<T>(p[0] * p[0] + 1e-4));
        if constexpr (Order >= 1) square.gradient[0] = static_cast<T>(2 * p[0]);
        if constexpr (Order >= 2) square.hessian.c[0] = T(2);
        return Jet<T, 3, Order>(static_cast<T>(h)) - sqrt(square);
    }
    double maxAbs() const { return 2; }
};

Vec3d velocityAt(const WallVelocity& wall, const Vec3d& p) {
    PointBatch points;
    points.push(p);
    VecBatch<double> w;
    wall.eval(points, w);
    return w[0];
}

Vec3d velocityOf(const Points& p, size_t k) {
    return {{static_cast<double>(p.vx[k]), static_cast<double>(p.vy[k]), static_cast<double>(p.vz[k])}};
}

} // namespace

TEST_CASE("WallVelocity: is bounded midway between two walls that close", "[track]") {
    const auto wallAt = [](double h) {
        return Wall{.sdf = {.distance = ScalarField(Gap{h}), .bounds = {}}, .side = Side::outside, .width = kWidth};
    };
    const double speed = 0.5;
    const WallVelocity wall(wallAt(0.1), wallAt(0.1 - speed * kStep), wallAt(0.1 - 2 * speed * kStep), kStep, cube(1));
    REQUIRE_FALSE(wall.rigid());
    CHECK(velocityAt(wall, {{0.1, 0, 0}})[0] == Approx(-speed).epsilon(0.02));
    for (double x = 1e-9; x < 0.1; x *= 1.5) CHECK(length(velocityAt(wall, {{x, 0, 0}})) < 2.3 * speed);
    for (double x = 1e-9; x < 1e-4; x *= 1.5) CHECK(length(velocityAt(wall, {{x, 0, 0}})) < 0.1 * speed);
}

TEST_CASE("WallVelocity: equals the velocity of a rigid wall at the wall and zero beyond the layer", "[track]") {
    const Motion motion;
    const auto side = GENERATE(Side::outside, Side::inside, Side::both);
    const double t = 0.7;
    const WallVelocity wall = motion.wallVelocity(t, side);
    REQUIRE(wall.rigid());
    CHECK(wall.terms().size() == 3);
    const ScalarField d = motion.at(t).sdf.distance;
    size_t atWall = 0, inBody = 0, far = 0;
    for (const Vec3d& p : randomPoints(cube(2), 4000, 1)) {
        const double distance = d.at<0>(p).value;
        const Vec3d w = velocityAt(wall, p), rigid = motion.velocityOf(p, t);
        if (std::abs(distance) < 0.1) { // the nearest point of the wall, where the full velocity applies
            ++atWall;
            const Vec3d foot = p - d.at<1>(p).gradient * distance, there = motion.velocityOf(foot, t);
            REQUIRE(std::abs(d.at<0>(foot).value) < 1e-12);
            CHECK(length(velocityAt(wall, foot) - there) < 1e-6 * length(there));
        }
        if (distance < 0 && side == Side::outside) {
            ++inBody;
            CHECK(length(w - rigid) < 1e-6 * length(rigid)); // the error of the three-point formula, and rounding
        }
        if (distance > kWidth || (distance < -kWidth && side != Side::outside)) {
            ++far;
            CHECK(w == Vec3d{});
            CHECK(wall.isFar(p, 0));
        }
    }
    CHECK(atWall > 5);
    CHECK(far > 100);
    CHECK((inBody > 0) == (side == Side::outside));
}

TEST_CASE("WallVelocity: a rigid wall adds a divergence-free flow", "[track]") {
    const WallVelocity wall = Motion{}.wallVelocity(0.2);
    const Flow flow(wall.terms(), {.box = cube(1), .wall = {}});
    const double coarse = divergenceFd(flow, cube(1), 500, 3, 1e-3), fine = divergenceFd(flow, cube(1), 500, 3, 5e-4);
    CAPTURE(coarse, fine);
    CHECK(fine < 1e-4);
    CHECK(fine < 0.4 * coarse); // second-order error of the differences
}

TEST_CASE("WallVelocity: the air passes a ball in all directions alike, faster in a thin layer", "[track]") {
    const double speed = 3, radius = 0.4;
    for (const double width : {0.1, 0.2, 0.4}) {
        CAPTURE(width);
        const auto at = [&](double t) {
            const Placement place{.offset = {{5 + speed * t, 0, 0}}};
            return Wall{.sdf = placed(sphereSdf(radius), place), .side = Side::outside, .width = width};
        };
        const WallVelocity wall(at(0), at(kStep), at(2 * kStep), kStep, cube(1));
        // With β = 1-α, w is the curl of ½ β V × r: β V cos θ along r, and -(β + ½ r dβ/dr) V sin θ along the circles
        // through both poles.
        double most = 0;
        for (double r = radius; r < radius + width; r += 0.01) {
            const Univariate<double> fade = quinticFade((r - radius) / width);
            const double along = 1 - fade.value, across = along - 0.5 * r * fade.first / width;
            most = std::max({most, along, std::abs(across)});
            for (const double turn : {0.3, 1.8, 4.0}) {
                const Vec3d side{{0, std::cos(turn), std::sin(turn)}};
                const Vec3d w = velocityAt(wall, Vec3d{{5, 0, 0}} + (Vec3d{{0.6, 0, 0}} + side * 0.8) * r);
                const Vec3d expected = Vec3d{{0.6, 0, 0}} + side * 0.8;
                CHECK(length(w - (expected * (along * 0.6) + (Vec3d{{0.8, 0, 0}} - side * 0.6) * (across * 0.8)) *
                                     speed) < 1e-5 * speed);
            }
        }
        const auto [ofWall, ofAir] = wall.speeds(cube(1));
        CHECK(ofWall == Approx(speed));
        CHECK(ofAir == Approx(speed * most).epsilon(0.05));
    }
    CHECK(Motion().wallVelocity(0).speeds(cube(1)).wall > 1.2); // the translation, and the turning at the corners
}

TEST_CASE("WallVelocity: the air goes the short way around a long body", "[track]") {
    const auto fastest = [](const Vec3d& velocity) {
        const auto at = [&](double t) {
            const Sdf bar = boxSdf({{0.3, 3, 0.3}}, 0.1);
            return Wall{.sdf = placed(bar, {.offset = velocity * t}), .side = Side::outside, .width = 0.1};
        };
        const auto speeds = WallVelocity(at(0), at(kStep), at(2 * kStep), kStep, cube(2)).speeds(cube(2));
        return speeds.air / speeds.wall;
    };
    // Around its ends, it would be about ten times as fast.
    for (const Vec3d& velocity : {Vec3d{{1, 0, 0}}, Vec3d{{0, 0, 1}}, Vec3d{{0.7, 0, 0.7}}, Vec3d{{0, 1, 0}}}) {
        CAPTURE(velocity[0], velocity[1], velocity[2]);
        CHECK(fastest(velocity) > 1);
        CHECK(fastest(velocity) < 5);
    }
}

TEST_CASE("WallVelocity: a plane that slides takes the air along and displaces none", "[track]") {
    for (const Vec3d& velocity : {Vec3d{{2, 0, 0}}, Vec3d{{0, 0, 2}}}) {
        const auto at = [&](double t) {
            const Sdf ground = planeSdf({{0, 1, 0}}, -3);
            return Wall{.sdf = placed(ground, {.offset = velocity * t}), .side = Side::outside, .width = 0.2};
        };
        const Box box{{{-2, -3.2, -2}}, {{2, 0, 2}}};
        const auto [wall, air] = WallVelocity(at(0), at(kStep), at(2 * kStep), kStep, box).speeds(box);
        CHECK(wall == Approx(2));
        CHECK(air < 1.5 * wall);
    }
}

TEST_CASE("WallVelocity: the air beside a body does not depend on how far it is from the origin of its pose",
          "[track]") {
    // A ball on a circle around the origin: placed there by its pose, or away from the origin within it.
    const double turning = 0.5;
    const auto velocityBeside = [&](const Sdf& shape, const Vec3d& offset) {
        const auto at = [&](double t) {
            const double angle = turning * t;
            const Placement place{.offset = {{offset[0] * std::cos(angle), 0, -offset[0] * std::sin(angle)}},
                                  .rotate = {{0, angle * 180 / std::numbers::pi, 0}}};
            return Wall{.sdf = placed(shape, place), .side = Side::outside, .width = 0.2};
        };
        return velocityAt({at(0), at(kStep), at(2 * kStep), kStep, cube(1)}, {{10.3, 0.4, 0.1}});
    };
    const Vec3d near = velocityBeside(sphereSdf(0.4), {{10, 0, 0}});
    const Vec3d far = velocityBeside(placed(sphereSdf(0.4), {.offset = {{10, 0, 0}}}), {});
    CHECK(length(near) > 1);
    CHECK(length(near - far) < 1e-4 * length(near));
}

TEST_CASE("WallVelocity: agrees with the motion of points by WallMotion", "[track]") {
    const Motion motion;
    // In the layer w changes by some forty times itself per second, so the mean velocity over dt is off by a fraction
    // of about (40 dt)². dt is short enough for the order to be visible.
    const double t = 0.3, dt = 5e-4;
    const auto worstAt = [&](double duration) {
        const WallMotion carried(motion.at(t - duration / 2), motion.at(t + duration / 2), cube(1.5));
        const WallVelocity wall = motion.wallVelocity(t);
        double worst = 0;
        for (const Vec3d& p : randomPoints(cube(1.2), 1000, 7)) {
            const double d = motion.at(t).sdf.distance.at<0>(p).value;
            if (d < 0.02 || d > kWidth) continue;
            std::vector<Vec3d> moved{p};
            carried.carry(moved);
            const Vec3d middle = (p + moved[0]) * 0.5;
            worst = std::max(worst, length((moved[0] - p) * (1 / duration) - velocityAt(wall, middle)));
        }
        return worst;
    };
    const double coarse = worstAt(2 * dt), fine = worstAt(dt);
    CAPTURE(coarse, fine);
    CHECK(fine < 1e-3);
    CHECK(fine < 0.35 * coarse); // second order
}

TEST_CASE("WallVelocity: a growing wall moves along its normals", "[track]") {
    const auto at = [](double t) {
        return Wall{.sdf = sphereSdf(0.5 + 0.2 * t), .side = Side::outside, .width = kWidth};
    };
    const WallVelocity wall(at(0), at(kStep), at(2 * kStep), kStep, cube(1.5));
    CHECK_FALSE(wall.rigid());
    CHECK_FALSE(wall.still());
    CHECK(wall.terms().empty());
    for (const Vec3d& p : randomPoints(cube(1), 200, 2)) {
        const Vec3d normal = p * (1 / length(p));
        CHECK(length(velocityAt(wall, normal * 0.5) - normal * 0.2) < 1e-9);
        if (length(p) > 0.5 + kWidth) CHECK(velocityAt(wall, p) == Vec3d{});
    }
}

TEST_CASE("WallVelocity: a surface that slides adds the tangential part of its velocity", "[track]") {
    const Vec3d spin{{0.4, -0.3, 1.2}};
    const auto at = [&](double t) {
        Wall wall{.sdf = sphereSdf(0.5 + 0.2 * t), .side = Side::outside, .width = kWidth};
        const auto component = [](const Vec3d& gradient) { return rampField(gradient); };
        wall.sdf.surfaceVelocity = {component({{3, -spin[2], spin[1]}}), component({{spin[2], 3, -spin[0]}}),
                                    component({{-spin[1], spin[0], 3}})}; // the spin, and a normal part
        return wall;
    };
    const WallVelocity wall(at(0), at(kStep), at(2 * kStep), kStep, cube(1.5));
    CHECK_FALSE(wall.still());
    CHECK_FALSE(wall.rigid());
    for (const Vec3d& p : randomPoints(cube(1), 200, 2)) {
        const Vec3d normal = p * (1 / length(p)), foot = normal * 0.5;
        CHECK(length(velocityAt(wall, foot) - normal * 0.2 - cross(spin, foot)) < 1e-9);
        if (length(p) > 0.5 + kWidth) CHECK(velocityAt(wall, p) == Vec3d{});
    }
    // Also if the form stays the same.
    const WallVelocity slides(at(0), at(0), at(0), kStep, cube(1.5));
    CHECK_FALSE(slides.still());
    CHECK(length(velocityAt(slides, {{0.5, 0, 0}}) - cross(spin, Vec3d{{0.5, 0, 0}})) < 1e-9);
}

TEST_CASE("WallVelocity: a wall at rest adds nothing", "[track]") {
    const Wall rests = Motion{}.at(0.4);
    const WallVelocity wall(rests, rests, rests, kStep, cube(1.5));
    CHECK(wall.still());
    CHECK(velocityAt(wall, {{0.7, 0, 0}}) == Vec3d{});
    const FlowInTime steady(boundFlow(sphereSdf(0.5), Side::outside));
    CHECK_FALSE(wallVelocity(steady, 0, kStep).has_value());
    const FlowInTime turning([](double) { return boundFlow(sphereSdf(0.5), Side::outside); });
    CHECK_FALSE(wallVelocity(turning, 0, kStep).has_value());
    CHECK_THROWS_AS(WallVelocity(rests, rests, rests, 0, cube(1)), ValueError);
}

TEST_CASE("WallVelocity: a rigid wall that rests for a part of the interval is rigid", "[track]") {
    const Wall rests = Motion{}.at(0.4), moved = Motion{}.at(0.4 + kStep);
    const WallVelocity starts(rests, rests, moved, kStep, cube(1.5)), returns(rests, moved, rests, kStep, cube(1.5));
    CHECK(starts.rigid());
    CHECK(returns.rigid());
    CHECK_FALSE(starts.still());
    CHECK(starts.terms().size() == 3);
    // A wall that starts to move in the middle of the interval rests at its beginning.
    const FlowInTime later([](double t) {
        const Wall wall = Motion{}.at(std::max(t, 0.6 * kStep));
        return Flow(constantField(1), constantField(0), {.box = cube(1.5), .wall = wall});
    });
    CHECK_FALSE(wallVelocity(later, 0, kStep).has_value());
}

TEST_CASE("WallVelocity: particle velocities match their paths to second order in the frame", "[track]") {
    const auto [growing, slides] = GENERATE(table<bool, bool>({{false, false}, {true, false}, {true, true}}));
    const FlowInTime flow([growing = growing, slides = slides](double t) {
        const Placement place{.offset = {{2 * t, 0.5 * t * t, 0}}, .rotate = {{0, 60 * t, 20 * t}}};
        const Sdf body = growing ? sphereSdf(0.4 + 0.5 * t) : boxSdf({{0.9, 0.7, 0.6}}, 0.25);
        Wall wall{.sdf = placed(body, place), .side = Side::outside, .width = kWidth};
        if (slides) { // about y, and without a pose, as of a mesh that deforms
            wall.sdf.pose = {};
            const double spin = 2 + t;
            wall.sdf.surfaceVelocity = {rampField({{0, 0, spin}}, 2), rampField({{0, 0, 0}}, t),
                                        rampField({{-spin, 0, 0}}, spin * 2 * t)};
        }
        return Flow(0.3 * noiseField<Psrd3>({.alpha = t, .seed = 1}, {.frequency = 1.5}),
                    bounded(noiseField<Psrd3>({.alpha = t, .seed = 2}, {.frequency = 1.5}), wall),
                    Domain::of(wall, 0.5));
    });
    constexpr double kMiddle = 0.2;
    const Vec3d centre{{2 * kMiddle, 0.5 * kMiddle * kMiddle, 0}};
    std::vector<Vec3d> points;
    for (const Vec3d& p : randomPoints(cube(0.8), 1500, 5))
        if (const double d = flow.at(kMiddle).domain().wall->sdf.distance.at<0>(centre + p).value; d > 0.03 && d < 0.25)
            points.push_back(centre + p);
    REQUIRE(points.size() > 200);
    // Back by one frame and forward by two: the velocity is compared in the middle.
    const auto step = [](double time) { return AdvectOptions{.time = time, .steps = 1, .accuracy = 1e-7}; };
    const auto errorAt = [&](double frame) {
        Points before = particlesAt(points);
        advect(flow, before, kMiddle, step(-frame));
        Points middle = before;
        advect(flow, middle, kMiddle - frame, step(frame));
        Points after = middle;
        advect(flow, after, kMiddle, step(frame));
        std::vector<double> errors;
        for (size_t k = 0; k < points.size(); ++k)
            errors.push_back(
                length((position(after, k) - position(before, k)) * (0.5 / frame) - velocityOf(middle, k)));
        return percentile(errors, 0.9, PercentileRank::nearest);
    };
    // The frames are short compared with the time in which a particle at the wall moves through its layer (width 0.3 at
    // a speed of 2 and more). Otherwise the path bends within a frame, and centred differences do not give the
    // velocity.
    const double coarse = errorAt(0.01), fine = errorAt(0.005);
    CAPTURE(growing, slides, coarse, fine);
    CHECK(fine < 0.02); // the speed is about 2
    CHECK(observedOrder(coarse, fine) > 1.7);
}
