// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flows.h"
#include "support/FlowChecks.h"
#include "support/Formula.h"

#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

std::array<ScalarField, 3> noises() {
    return {noiseField<Psrd3>({.seed = 1}), noiseField<SimplexNoise<3>>({.seed = 2}), noiseField<PerlinNoise<3>>()};
}

std::array<ScalarFieldN<2>, 3> planeNoises() {
    return {noiseField<Psrd2>({.seed = 1}), noiseField<SimplexNoise<2>>({.seed = 2}), noiseField<SineNoise<2>>()};
}

/// Requires that the velocity equals a closed form, up to a few roundings of its size or of `scale`.
template <class Velocity>
void requireVelocity(const Flow& flow, const Box& box, const Velocity& velocity, double scale = 0) {
    Worst worst;
    for (const Vec3d& p : randomPoints(box, 10000, 1)) {
        const Vec3d c = velocity(p);
        worst.see(length(flow.at(p).velocity - c) / (length(c) + scale), p);
    }
    CAPTURE(worst.value, worst.where);
    CHECK(worst.value < 16 * 0x1p-53);
}

/// Checks third derivatives, which a field needs to displace another one, by central differences of the Hessian. Their
/// error is a fifth derivative times h².
void requireThird(const ScalarField& field, const std::vector<Vec3d>& points, double fifthDerivative) {
    constexpr double kStep = 0x1p-12;
    Worst worst;
    for (const Vec3d& p : points) {
        const auto jet = field.at<3>(p);
        for (int k = 0; k < 3; ++k) {
            const auto up = field.at<2>(p + unit(k) * kStep), down = field.at<2>(p - unit(k) * kStep);
            for (int i = 0; i < 3; ++i)
                for (int j = i; j < 3; ++j)
                    worst.see(std::abs((up.hessian(i, j) - down.hessian(i, j)) / (2 * kStep) - jet.third(i, j, k)), p);
        }
    }
    CAPTURE(worst.value, worst.where);
    CHECK(worst.value < fifthDerivative * (kStep * kStep / 6 + 0x1p-52 / kStep));
}

} // namespace

TEST_CASE("curlFlow: velocity is the curl of the potentials", "[flow]") {
    const auto psi = noises();
    const Flow flow = curlFlow(psi, {.box = cube(2), .wall = {}});
    CHECK(flow.domain().box.upper == Vec3d{{2, 2, 2}});
    CHECK(flow.terms().size() == 3);
    CHECK_FALSE(flow.hasTracks());
    for (const Vec3d& p : randomPoints(cube(3), 2000, 1)) {
        const Vec3d x = psi[0].at<1>(p).gradient, y = psi[1].at<1>(p).gradient, z = psi[2].at<1>(p).gradient;
        CAPTURE(p);
        const Vec3d curl{{z[1] - y[2], x[2] - z[0], y[0] - x[1]}};
        REQUIRE(length(flow.at(p).velocity - curl) < 1e-14);
    }
    // If all three potentials are equal, the flow is orthogonal to (1, 1, 1), as the tutorial observes.
    const Flow flat = curlFlow(std::array{psi[0], psi[0], psi[0]});
    for (const Vec3d& p : randomPoints(cube(3), 100, 1)) {
        const Vec3d c = flat.at(p).velocity;
        REQUIRE(std::abs(c[0] + c[1] + c[2]) < 1e-14);
    }
}

TEST_CASE("curlFlow: three 2D noises give the curl noise of the tutorial", "[flow]") {
    // "3D Curl, using 2D Value and Perlin noise": the first and second derivatives of the samples, each at its
    // position.
    const auto psi = planeNoises();
    const Flow flow = curlFlow(psi, {.box = cube(2), .wall = {}});
    CHECK_FALSE(flow.hasTracks());
    CHECK(flow.domain().box.upper == Vec3d{{2, 2, 2}});
    for (const Vec3d& p : randomPoints(cube(3), 2000, 1)) {
        const auto x = psi[0].at<1>({{p[2], p[1]}}).gradient, y = psi[1].at<1>({{p[0], p[2]}}).gradient,
                   z = psi[2].at<1>({{p[1], p[0]}}).gradient;
        CAPTURE(p);
        REQUIRE(length(flow.at(p).velocity - Vec3d{{z[0] - y[1], x[0] - z[1], y[0] - x[1]}}) < 1e-14);
    }
}

TEST_CASE("curlFlow: in a wall each term is tangent and unchanged beyond the layer", "[flow]") {
    const Side side = GENERATE(Side::inside, Side::outside, Side::both);
    const Wall wall{.sdf = sphereSdf(1), .side = side, .width = 0.2};
    const Flow open = curlFlow(noises()), closed = curlFlow(noises(), Domain::of(wall));
    REQUIRE(closed.terms().size() == 3);
    for (const Vec3d& p : randomPoints(cube(1), 500, 9)) {
        const Vec3d n = p * (1 / length(p));
        CAPTURE(p);
        for (const auto& term : closed.terms()) {
            const Vec3d c = cross(term[0].at<1>(n).gradient, term[1].at<1>(n).gradient);
            REQUIRE(std::abs(dot(c, n)) < 1e-13); // a rounding off the wall, where the slope of the ramp is 9
            REQUIRE(length(c) < 100);
        }
        const Vec3d inside = n * 0.75, outside = n * 1.25;
        const double in = side == Side::outside ? -1 : 1; // the ramp is 1 on the flow's side
        REQUIRE(length(closed.at(inside).velocity - open.at(inside).velocity * in) < 1e-13);
        REQUIRE(length(closed.at(outside).velocity + open.at(outside).velocity * in) < 1e-13);
    }
    requireDivergenceFree(closed, cube(1.3));
}

TEST_CASE("curlFlow: is divergence-free", "[flow]") {
    const Flow space = curlFlow(noises()), plane = curlFlow(planeNoises());
    requireDivergenceFree(space, cube(2));
    requireDivergenceFree(plane, cube(2));
    requireJacobian(space, cube(2), 1000, 3);
    requireJacobian(plane, cube(2), 1000, 3);
}

TEST_CASE("uniformFlow: has constant velocity and straight tracks", "[flow]") {
    std::vector<Vec3d> velocities = randomPoints(cube(1), 200, 2);
    for (const double x : {-1.0, 0.0, 1.0})
        for (const double y : {-1.0, 0.0, 1.0})
            for (const double z : {-1.0, 0.0, 1.0})
                if (x != 0 || y != 0 || z != 0) velocities.push_back({{x, y, z}});
    for (const Vec3d& v : randomPoints(cube(1), 50, 3)) velocities.push_back({{v[0], v[1] * 1e-9, v[2] * 1e-17}});
    for (const double size : {1e-100, 1e-12, 1e12, 1e100}) velocities.push_back(Vec3d{{1, -2, 3}} * size);
    for (const Vec3d& velocity : velocities) {
        CAPTURE(velocity);
        const Flow flow = uniformFlow(velocity, {.box = cube(7), .wall = {}});
        CHECK(flow.hasTracks());
        CHECK(flow.divergenceFree());
        CHECK(flow.domain().box.upper[0] == 7);
        for (const Vec3d& p : {Vec3d{}, Vec3d{{1, 2, -3}}, Vec3d{{1e6, -1e6, 0}}}) {
            const auto sample = flow.at(p);
            CHECK(length(sample.velocity - velocity) <= 8 * 0x1p-53 * length(velocity));
            CHECK(frobenius(sample.derivative) == 0);
            // Along the flow the potentials are constant, up to a rounding of their size.
            const auto later = flow.at(p + velocity * (3 / length(velocity)));
            for (size_t k = 0; k < 2; ++k)
                CHECK(std::abs(later.potentials[k] - sample.potentials[k]) <=
                      8 * 0x1p-53 * (length(p) + 3) * std::max(1.0, length(velocity)));
        }
    }
    for (const Vec3d& bad : {Vec3d{}, Vec3d{{std::nan(""), 0, 0}}, Vec3d{{0, HUGE_VAL, 0}}})
        CHECK_THROWS_WITH(uniformFlow(bad), Catch::ContainsSubstring("speed"));
}

TEST_CASE("placed: a flow moves and turns with its place", "[flow]") {
    const Placement placement{.offset = {{5, -2, 1}}, .rotate = {{20, -40, 70}}};
    const Matrix3 turn = rotationOf(placement);
    for (const Flow& flow : {vortexFlow(0.7, 0.4), updraftFlow(2, 0.5)}) {
        const Flow there = placed(flow, placement);
        CHECK(there.hasTracks() == flow.hasTracks());
        for (const Vec3d& p : randomPoints(cube(1), 50, 1)) {
            const auto a = flow.at(p), b = there.at(turn * p + placement.offset);
            CAPTURE(p);
            REQUIRE(length(b.velocity - turn * a.velocity) < 1e-12);
        }
    }
    CHECK_THROWS_AS(placed(vortexFlow(1, 1), {.scale = {{2, 2, 2}}}), ValueError);
    const Domain walled{.box = cube(1), .wall = Wall{.sdf = sphereSdf(0.5), .side = Side::outside, .width = 0.1}};
    CHECK_THROWS_AS(placed(vortexFlow(1, 1, walled), placement), ValueError);
}

TEST_CASE("vortexFlow: velocity has its closed form", "[flow]") {
    for (const auto& [turns, core] : {std::pair{1.0, 0.3}, std::pair{-0.25, 2.0}, std::pair{1e-3, 1e-3}}) {
        CAPTURE(turns, core);
        const Flow flow = vortexFlow(turns, core, {.box = cube(2), .wall = {}});
        CHECK(flow.hasTracks());
        CHECK(flow.domain().box.upper[0] == 2);
        const auto velocity = [turns = turns, core = core](const Vec3d& p) {
            const double omega = 2 * std::numbers::pi * turns / (1 + (p[0] * p[0] + p[2] * p[2]) / (core * core));
            return cross(Vec3d{{0, omega, 0}}, p); // right-handed about +y
        };
        requireVelocity(flow, cube(2), velocity);
        requireVelocity(flow, cube(0.1 * core), velocity);
        CHECK(flow.at({{0, 5, 0}}).velocity == Vec3d{});
        requireDivergenceFree(flow, cube(2 * core), {.count = 20000, .step = 0x1p-10 * core});
        requireJacobian(flow, cube(2 * core), 500, 3, 0x1p-9 * core);
    }
    // One turn per second on the axis. Near it, a quarter turn takes a quarter of a second and leads from z to x.
    const Flow flow = vortexFlow(1, 1e3);
    CHECK(length(flow.at({{0, 0, 1}}).velocity - Vec3d{{2 * std::numbers::pi, 0, 0}}) < 1e-5);
    for (const double bad : {0.0, -1.0, std::nan(""), static_cast<double>(INFINITY)}) {
        CAPTURE(bad);
        CHECK_THROWS_WITH(vortexFlow(1, bad), Catch::ContainsSubstring("core"));
    }
    for (const double bad : {0.0, std::nan(""), static_cast<double>(INFINITY)})
        CHECK_THROWS_WITH(vortexFlow(bad, 1), Catch::ContainsSubstring("turns"));
    const auto points = randomPoints(cube(1), 500, 4);
    requireDerivatives(vortexFlow(1, 0.8).f(), points, 0x1p-9, 200); // observed: 40
    requireThird(vortexFlow(1, 0.8).f(), points, 2e4);
}

TEST_CASE("updraftFlow: velocity has its closed form above and below the ground", "[flow]") {
    for (const auto& [speed, height] : {std::pair{1.0, 1.0}, std::pair{-2.5, 0.4}, std::pair{3.0, 20.0}}) {
        CAPTURE(speed, height);
        const Flow flow = updraftFlow(speed, height, {.box = cube(2), .wall = {}});
        CHECK_FALSE(flow.hasTracks());
        CHECK(flow.domain().box.upper[0] == 2);
        const auto above = [speed = speed, height = height](const Vec3d& p) {
            const double rise = speed / (1 + p[1] / height), slope = -rise * rise / (speed * height);
            return Vec3d{{-slope * p[0] / 2, rise, -slope * p[2] / 2}};
        };
        // 1 - t + t² with t = y / height.
        const auto below = [speed = speed, height = height](const Vec3d& p) {
            const double t = p[1] / height, slope = speed * (2 * t - 1) / height;
            return Vec3d{{-slope * p[0] / 2, speed * (1 - t + t * t), -slope * p[2] / 2}};
        };
        requireVelocity(flow, {{{-2, 0, -2}}, {{2, 5, 2}}}, above);
        requireVelocity(flow, {{{-2, -5, -2}}, {{2, 0, 2}}}, below);
        CHECK(flow.at({}).velocity == Vec3d{{0, speed, 0}});
        CHECK(flow.at({{0, height, 0}}).velocity == Vec3d{{0, speed / 2, 0}});
        requireDivergenceFree(flow, cube(2));
        requireJacobian(flow, {{{-1, 0.1, -1}}, {{1, 2, 1}}}, 500, 3);
    }
    for (const double bad : {0.0, -1.0, std::nan(""), static_cast<double>(INFINITY)}) {
        CAPTURE(bad);
        CHECK_THROWS_WITH(updraftFlow(1, bad), Catch::ContainsSubstring("height"));
    }
    for (const double bad : {0.0, std::nan(""), static_cast<double>(INFINITY)})
        CHECK_THROWS_WITH(updraftFlow(bad, 1), Catch::ContainsSubstring("speed"));
}

TEST_CASE("updraftFlow: potentials are C² at the ground", "[flow]") {
    const Flow flow = updraftFlow(2, 0.5);
    for (const auto& term : flow.terms()) {
        for (const Vec3d& p : randomPoints(cube(1), 200, 5)) {
            // The third derivatives are at most 6 · 2 / 0.5³ · |x| / 2 = 48. The part that is missing below is as
            // large.
            const double eps = 1e-7;
            const auto up = term[0].at<2>({{p[0], eps, p[2]}}), down = term[0].at<2>({{p[0], -eps, p[2]}}),
                       at = term[0].at<2>({{p[0], 0, p[2]}});
            CAPTURE(p);
            REQUIRE(difference(up, at) < 100 * eps);
            REQUIRE(difference(down, at) < 100 * eps);
        }
        // On either side and across: only the third derivative jumps.
        requireDerivatives(term[0], randomPoints(Box{{{-1, 0.01, -1}}, {{1, 2, 1}}}, 500, 6), 0x1p-9, 1000);
        requireThird(term[0], randomPoints(Box{{{-1, 0.01, -1}}, {{1, 2, 1}}}, 500, 6), 1e4);
        requireThird(term[0], randomPoints(Box{{{-1, -2, -1}}, {{1, -0.01, 1}}}, 500, 6), 1e3);
    }
}

TEST_CASE("enrightFlow: is the published deformation field and reverses in time", "[flow]") {
    constexpr double kPi = std::numbers::pi;
    const auto published = [](const Vec3d& p) {
        const auto s = [&](int axis) { return std::sin(kPi * p[axis]); };
        const auto d = [&](int axis) { return std::sin(2 * kPi * p[axis]); };
        return Vec3d{{2 * s(0) * s(0) * d(1) * d(2), -d(0) * s(1) * s(1) * d(2), -d(0) * d(1) * s(2) * s(2)}};
    };
    const Flow flow = enrightFlow();
    CHECK_FALSE(flow.hasTracks());
    CHECK(flow.domain().box.lower == Vec3d{{0, 0, 0}});
    CHECK(flow.domain().box.upper == Vec3d{{1, 1, 1}});
    requireVelocity(flow, flow.domain().box, published, 1);
    requireDivergenceFree(flow, flow.domain().box);
    for (const auto& term : flow.terms())
        requireDerivatives(term[0], randomPoints(flow.domain().box, 500, 3), 0x1p-9, 1e4);
    const FlowInTime inTime = enrightFlowInTime(2);
    CHECK_FALSE(inTime.steady());
    const Vec3d p{{0.3, 0.4, 0.1}};
    for (const double t : {0.0, 0.3, 1.0, 1.7})
        CHECK(length(inTime.at(t).at(p).velocity - published(p) * std::cos(kPi * t / 2)) < 1e-15);
    CHECK_THROWS_WITH(enrightFlowInTime(0), Catch::ContainsSubstring("period"));
}

TEST_CASE("Flow: a sum of all kinds of flows is divergence-free", "[flow]") {
    const Flow sum = vortexFlow(0.5, 0.5) + updraftFlow(1, 1) + uniformFlow({{0.3, 0, 0.1}}) + curlFlow(noises());
    CHECK(sum.terms().size() == 1 + 2 + 1 + 3);
    requireDivergenceFree(sum, cube(1));
    for (const Vec3d& p : randomPoints(cube(1), 100, 7)) {
        const Vec3d parts = vortexFlow(0.5, 0.5).at(p).velocity + updraftFlow(1, 1).at(p).velocity +
                            Vec3d{{0.3, 0, 0.1}} + curlFlow(noises()).at(p).velocity;
        REQUIRE(length(sum.at(p).velocity - parts) < 1e-14);
    }
}

TEST_CASE("gradientFlow: velocity is the gradient, and its derivative the Hessian", "[flow]") {
    const ScalarField field = noises()[0];
    const Flow flow = gradientFlow(field);
    CHECK_FALSE(flow.divergenceFree());
    Worst worst;
    for (const Vec3d& p : randomPoints(cube(1), 500, 1)) {
        const auto jet = field.at<2>(p);
        const FlowSample sample = flow.at(p);
        worst.see(length(sample.velocity - jet.gradient), p);
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) worst.see(std::abs(sample.derivative[i][j] - jet.hessian(i, j)), p);
    }
    CAPTURE(worst.where);
    CHECK(worst.value == 0);
    requireJacobian(gradientFlow(planeNoises()[0]), cube<2>(1), 200, 1);
    PointBatch one;
    one.push({{0.1, 0.2, 0.3}});
    JetBatch<float, 1> floats;
    JetBatch<double, 1> doubles;
    flow.components()[0][1].eval(one, floats);
    flow.components()[0][1].eval(one, doubles);
    CHECK(static_cast<double>(floats[0].gradient[1]) == Approx(doubles[0].gradient[1]));
    CHECK_THROWS_AS(flow.components()[0][0].at<3>({}), ValueError);
}
