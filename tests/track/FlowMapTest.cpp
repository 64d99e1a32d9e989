// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flows.h"
#include "curlew/track/FlowMap.h"
#include "support/Formula.h"
#include "support/Points.h"

#include <limits>
#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

const Domain kBox{.box = cube(3), .wall = {}};

ScalarField moreSines() {
    return formula([](const auto& x) { return sin(x[0] * 2 - x[2]) + cos(x[1] + x[2] * 2); });
}

/// A time-dependent flow of one term.
FlowInTime swaying() {
    return FlowInTime([](double t) { return Flow(0.1 * sinesF(), sinesG() + std::sin(3 * t) * moreSines(), kBox); });
}
/// A time-dependent sum.
FlowInTime swayingSum() {
    return FlowInTime([](double t) {
        return Flow(0.1 * sinesF(), std::cos(2 * t) * sinesG(), kBox) + uniformFlow({{0.3, std::sin(t) + 2, 0}}, kBox);
    });
}

Flow contained(double radius, double width) {
    const Wall wall{.sdf = sphereSdf(radius), .side = Side::inside, .width = width};
    return withSpeed(Flow(noiseField<Psrd3>({.seed = 1}, {.frequency = 1.5}),
                          bounded(noiseField<Psrd3>({.seed = 2}, {.frequency = 1.5}), wall), Domain::of(wall)),
                     1);
}

double greatestDifference(const std::vector<Vec3d>& a, const std::vector<Vec3d>& b) {
    double worst = 0;
    for (size_t k = 0; k < a.size(); ++k) worst = std::max(worst, length(a[k] - b[k]));
    return worst;
}

/// Returns the observed order of the map over one second, from the differences between its results in 8, 16 and 32
/// steps.
double orderOf(const FlowInTime& flow, Scheme scheme, double from) {
    const auto moved = [&](double steps) {
        std::vector<Vec3d> points = randomPoints(cube(1), 20, 3);
        FlowMap(flow, {.step = 1 / steps, .scheme = scheme}).carry(points, from, from - 1);
        return points;
    };
    const auto eight = moved(8), sixteen = moved(16), most = moved(32);
    return std::log2(greatestDifference(eight, sixteen) / greatestDifference(sixteen, most));
}

} // namespace

TEST_CASE("FlowMap: a uniform flow is a translation", "[track]") {
    const FlowMap map(uniformFlow({{1, -2, 0.5}}), {.step = 0.1});
    std::vector<Vec3d> points = randomPoints(cube(1), 100, 1), start = points;
    CHECK(map.steps(0, 0.45) == 5);
    CHECK(map.steps(3, 2) == 10);
    const FlowMapResult result = map.carry(points, 5, 5.45);
    CHECK(result.points == 100);
    CHECK(result.stalled == 0);
    for (size_t k = 0; k < points.size(); ++k) CHECK(length(points[k] - start[k] - Vec3d{{0.45, -0.9, 0.225}}) < 1e-14);
    map.carry(points, 5.45, 5);
    CHECK(greatestDifference(points, start) < 1e-14);
}

TEST_CASE("FlowMap: a steady flow has the order of the scheme", "[track]") {
    const Flow track(0.1 * sinesF(), sinesG(), kBox);
    for (const Flow& flow : {track, track + uniformFlow({{0.3, 0.1, 0}}, kBox)}) {
        CAPTURE(flow.hasTracks());
        CHECK(orderOf(flow, Scheme::rk4, 0) > 3.6);
        CHECK(orderOf(flow, Scheme::midpoint, 0) == Approx(2).margin(0.4));
    }
}

TEST_CASE("FlowMap: a changing flow has second order in time", "[track]") {
    CHECK(orderOf(swaying(), Scheme::rk4, 1.7) == Approx(2).margin(0.3));
    CHECK(orderOf(swayingSum(), Scheme::rk4, 1.7) == Approx(2).margin(0.3));
}

TEST_CASE("FlowMap: backward integration returns to the start", "[track]") {
    for (const FlowInTime& flow : {swaying(), swayingSum(), FlowInTime(contained(1, 0.3))}) {
        const FlowMap map(flow, {.step = 0.05});
        std::vector<Vec3d> points = randomPoints(cube(0.5), 100, 5);
        const auto start = points;
        map.carry(points, 0.3, 1.3);
        CHECK(greatestDifference(points, start) > 0.2);
        map.carry(points, 1.3, 0.3);
        // Both directions use the same frozen flows, so only the errors of the steps remain, which are of fourth order.
        CHECK(greatestDifference(points, start) < 5e-3);
    }
}

TEST_CASE("FlowMap: in a contained flow points keep their side and those beyond keep their distance", "[track]") {
    const FlowMap map(contained(1, 0.3), {.step = 0.05});
    std::vector<Vec3d> points = randomPoints(cube(1.1), 500, 6);
    const auto start = points;
    map.carry(points, 0, -2);
    double moved = 0;
    for (size_t k = 0; k < points.size(); ++k) {
        const double before = length(start[k]) - 1, after = length(points[k]) - 1;
        CAPTURE(start[k], points[k]);
        REQUIRE((before < 0) == (after < 0));
        if (before <= 0) continue;
        REQUIRE(after == Approx(before).margin(1e-6));
        moved = std::max(moved, length(points[k] - start[k]));
    }
    CHECK(moved > 0.5); // the flow continues smoothly beyond the wall
}

TEST_CASE("FlowMap: invalid times and steps are refused and NaN positions pass through", "[track]") {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS_WITH(FlowMap(swaying(), {.step = -1}), Catch::ContainsSubstring("step"));
    CHECK_THROWS_AS(FlowMap(swaying(), {.step = nan}), ValueError);
    const FlowMap map(swayingSum(), {.step = 0.1});
    std::vector<Vec3d> points{{{0, 0, 0}}, {{nan, 0.25, 0}}};
    CHECK_THROWS_WITH(map.carry(points, 0, nan), Catch::ContainsSubstring("finite"));
    CHECK_THROWS_AS(map.carry(points, 0, std::numeric_limits<double>::infinity()), ValueError);
    CHECK_THROWS_AS(map.carry(points, 0, 1e12), ValueError);
    map.carry(points, 0, 1);
    CHECK(std::isfinite(points[0][0]));
    CHECK(std::isnan(points[1][0]));
    CHECK(points[1][1] == 0.25);
    std::vector<Vec3d> none;
    CHECK(map.carry(none, 0, 1).points == 0);
    std::vector<Vec3d> still{{{1, 2, 3}}};
    map.carry(still, 4, 4);
    CHECK(still[0] == Vec3d{{1, 2, 3}});
    CHECK_THROWS_AS(map.carry(still, 0, 1, {.report = {}, .cancelled = [] { return true; }}), Interrupted);
}

TEST_CASE("FlowMap: refuses the options that advect refuses, for sums too", "[track]") {
    for (const FlowInTime& flow : {swaying(), swayingSum()}) {
        std::vector<Vec3d> points{{{0, 0, 0}}};
        const auto carry = [&](const FlowMapOptions& options) { FlowMap(flow, options).carry(points, 0, 1); };
        CHECK_THROWS_WITH(carry({.step = 0.1, .scheme = Scheme::rk4, .accuracy = 1e-3}),
                          Catch::ContainsSubstring("rk4 has no error estimate"));
        CHECK_THROWS_WITH(carry({.scheme = Scheme::euler}), Catch::ContainsSubstring("euler has no error estimate"));
        CHECK_THROWS_WITH(carry({.step = 0.1, .accuracy = -1}), Catch::ContainsSubstring("accuracy -1"));
    }
}

TEST_CASE("FlowMap: is the same for any number of threads", "[track]") {
    const FlowMap map(swayingSum(), {.step = 0.1});
    std::vector<std::vector<Vec3d>> results;
    for (const int threads : {1, 2}) {
        const ThreadLimit limit(threads);
        results.push_back(randomPoints(cube(1), 1000, 2));
        map.carry(results.back(), 0, 1);
    }
    CHECK(results[0] == results[1]);
}
