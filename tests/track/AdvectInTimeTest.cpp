// SPDX-License-Identifier: Apache-2.0
// advect() in time-dependent flows (track/Advect.h).
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flows.h"
#include "curlew/track/Advect.h"
#include "curlew/track/Pathlines.h"
#include "curlew/track/Scatter.h"
#include "support/FiniteDifference.h"
#include "support/MovingPoints.h"
#include "support/Statistics.h"

#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

/// A flow inside or around a wall. The gradients of its noise rotate once per second.
Flow turning(double t, const Wall& wall, double padding = 0.5) {
    const double alpha = 2 * std::numbers::pi * t;
    return Flow(noiseField<Psrd3>({.alpha = alpha, .seed = 1}, {.frequency = 1.5}),
                bounded(noiseField<Psrd3>({.alpha = alpha, .seed = 2}, {.frequency = 1.5}), wall),
                Domain::of(wall, padding));
}

/// Returns the order of convergence if the number of steps is doubled, relative to a solution with many more steps.
double orderInTime(const FlowInTime& flow, const std::vector<Vec3d>& points) {
    const auto end = [&](int steps) {
        Points particles = particlesAt(points);
        advect(flow, particles, 0.1, {.time = 0.4, .steps = steps, .reprojection = {.tolerance = 1e-12}});
        return particles;
    };
    const Points exact = end(256);
    const auto error = [&](int steps) {
        const Points particles = end(steps);
        std::vector<double> errors;
        for (size_t k = 0; k < points.size(); ++k)
            errors.push_back(length(position(particles, k) - position(exact, k)));
        return median(errors);
    };
    const double coarse = error(20), fine = error(40);
    CAPTURE(coarse, fine);
    CHECK(fine > 1e-9);
    return observedOrder(coarse, fine);
}

} // namespace

TEST_CASE("advect: a steady FlowInTime gives the same result as the Flow", "[track]") {
    const Flow flow = turning(0, {.sdf = sphereSdf(1), .side = Side::inside, .width = 0.2});
    Points a = scatter(flow.domain(), 200, 1), b = a;
    advect(flow, a, {.steps = 5});
    advect(FlowInTime(flow), b, 7, {.steps = 5});
    CHECK(a.x == b.x);
    CHECK(a.vz == b.vz);
    CHECK(a.f == b.f);
    // Advecting step by step, each on new tracks, gives nearly the same.
    Points c = scatter(flow.domain(), 200, 1);
    advect(FlowInTime([&](double) { return flow; }), c, 7, {.steps = 5});
    std::vector<double> apart; // a few particles separate at stagnation points
    for (size_t k = 0; k < a.size(); ++k) apart.push_back(length(position(a, k) - position(c, k)));
    CHECK(median(apart) < 1e-7);
}

TEST_CASE("advect: a changing flow is followed to second order in time", "[track]") {
    const Wall wall{.sdf = sphereSdf(1), .side = Side::inside, .width = 0.2};
    const FlowInTime flow([&](double t) { return turning(t, wall); });
    const auto points = randomPoints(cube(0.5), 200, 3);
    const double order = orderInTime(flow, points);
    CHECK(order > 1.8);
    CHECK(order < 2.6);
}

TEST_CASE("advect: accuracy controls how often a changing flow is sampled in time", "[track]") {
    const Wall wall{.sdf = sphereSdf(1), .side = Side::inside, .width = 0.2};
    const auto points = randomPoints(cube(0.5), 200, 3);
    const auto followed = [&](double pace, const AdvectOptions& options, AdvectResult& result) {
        Points particles = particlesAt(points);
        result = advect(FlowInTime([&](double t) { return turning(pace * t, wall); }), particles, 0.1, options);
        return particles;
    };
    AdvectResult coarse, fine, many;
    const Points a = followed(1, {.time = 0.2, .steps = 4, .accuracy = 8e-5}, coarse);
    const Points b = followed(1, {.time = 0.2, .steps = 4, .accuracy = 1e-5}, fine);
    const Points exact = followed(1, {.time = 0.2, .steps = 600, .scheme = Scheme::rk4}, many);
    const auto apart = [&](const Points& p) {
        double sum = 0;
        for (size_t k = 0; k < points.size(); ++k) sum += length(position(p, k) - position(exact, k));
        return sum / static_cast<double>(points.size());
    };
    CAPTURE(coarse.moments, fine.moments, coarse.freezing, fine.freezing, apart(a), apart(b));
    CHECK(coarse.moments > 4);
    // The error per step is of third order: an eighth of it takes twice as many steps.
    CHECK(static_cast<double>(fine.moments) / static_cast<double>(coarse.moments) == Approx(2).margin(0.6));
    CHECK(fine.freezing < 0.5 * coarse.freezing);
    CHECK(apart(b) < 0.5 * apart(a));
    // The estimate is not exact: the flow stretches earlier errors, and errors of opposite signs cancel.
    CHECK(apart(b) < 4 * fine.freezing);
    CHECK(apart(b) > fine.freezing / 20);
    AdvectResult slow, equal;
    followed(1e-4, {.time = 0.2, .steps = 4, .accuracy = 1e-5}, slow);
    CHECK(slow.moments == 4);
    followed(1, {.time = 0.2, .steps = 4, .scheme = Scheme::rk4}, equal);
    CHECK(equal.moments == 4);
    CHECK(equal.freezing == 0);
}

TEST_CASE("advect: a moving wall is followed to second order in time", "[track]") {
    const FlowInTime flow([&](double t) {
        const Placement place{.offset = {{std::sin(t), 0, 0}}, .rotate = {{0, 60 * t, 0}}};
        return turning(t, {.sdf = placed(sphereSdf(0.5), place), .side = Side::outside, .width = 0.3}, 1);
    });
    std::vector<Vec3d> points;
    for (const Vec3d& p : randomPoints(cube(1), 1000, 3))
        if (const double d = length(p - Vec3d{{0.1, 0, 0}}) - 0.5; d > 0.05 && d < 0.3) points.push_back(p);
    REQUIRE(points.size() > 100);
    const double order = orderInTime(flow, points);
    CHECK(order > 1.8); // the error of RK4 is not negligible at these steps
    CHECK(order < 3.2);
}

TEST_CASE("advect: no particle crosses a moving wall for any step size", "[track]") {
    const auto side = GENERATE(Side::outside, Side::inside);
    const auto wallAt = [side](double t) {
        const Placement place{.offset = {{0.8 * std::sin(2 * t), 0.3 * t, 0}}, .rotate = {{0, 90 * t, 45 * t}}};
        return Wall{.sdf = placed(boxSdf({{1, 0.8, 0.6}}, 0.25), place), .side = side, .width = 0.2};
    };
    const FlowInTime flow([&](double t) { return turning(t, wallAt(t), 1); });
    const auto steps = GENERATE(3, 20);
    Points particles = scatter(flow.at(0).domain(), 500, 2);
    const auto start = particles;
    const AdvectResult result = advect(flow, particles, 0, {.time = 1, .steps = steps});
    CAPTURE(static_cast<int>(side), steps);
    CHECK(result.outside == 0);
    CHECK(result.overrun == 0);
    CHECK(countOutside(flow.at(1).domain(), particles) == 0);
    CHECK(countOutside(flow.at(1).domain(), start) > 5); // the wall has moved over the start positions
    // f and g are those of the flow at the end, including its wall.
    const Vec3d p = position(particles, 7);
    CHECK(particles.f[7] == flow.at(1).f().at<0>(p).value);
}

TEST_CASE("advect: a moving wall pushes particles that are just born, too", "[track]") {
    const FlowInTime flow([](double t) {
        const Sdf ball = placed(sphereSdf(0.5), {.offset = {{2 * t, 0, 0}}});
        return turning(0, {.sdf = ball, .side = Side::outside, .width = 0.2});
    });
    Points born = particlesAt({{{0.51, 0, 0}}, {{0.7, 0.2, 0}}, {{1, 0, 0.1}}, {{0, 3, 0}}});
    born.age.assign(born.size(), 0);
    const AdvectResult result = advect(flow, born, 0, {.time = 0.5, .steps = 10, .byAge = true});
    CHECK(result.outside == 0);
    CHECK(result.overrun == 0);
    for (size_t k = 0; k < born.size(); ++k) CHECK(length(position(born, k) - Vec3d{{1, 0, 0}}) > 0.5);
    CHECK(position(born, 0)[0] > 1.4);
    CHECK(position(born, 3) == Vec3d{{0, 3, 0}}); // the flow has not moved it yet
}

TEST_CASE("advect: particles born on a moving wall stay on it as it turns and moves", "[track]") {
    // Nothing flows, so a particle that is born on the wall has to end where it was born, beside the wall of the end.
    const FlowInTime flow([](double t) {
        const Placement place{.offset = {{2 * t, 0, 0}}, .rotate = {{0, 0, 40 * t}}};
        const Sdf box = placed(boxSdf({{1, 0.8, 0.6}}, 0.25), place);
        return uniformFlow({{1e-9, 0, 0}},
                           {.box = cube(2), .wall = Wall{.sdf = box, .side = Side::outside, .width = 0.2}});
    });
    const Domain end = flow.at(0.5).domain();
    Points born = scatterFrom(end, 0, 200, {.on = ScatterOn::surface, .level = 0.01});
    for (size_t k = 0; k < born.size(); ++k) born.age.push_back(static_cast<float>(k) * 0.0025f);
    const Points start = born;
    const AdvectResult result = advect(flow, born, 0, {.time = 0.5, .steps = 8, .byAge = true});
    CHECK(result.outside == 0);
    CHECK(result.overrun == 0);
    double farthest = 0;
    for (size_t k = 0; k < born.size(); ++k)
        farthest = std::max(farthest, length(position(born, k) - position(start, k)));
    CHECK(farthest < 0.03); // the wall moves by 1, and turns on a somewhat different way back and forth
    // Pathlines end there, too.
    Points along = start;
    advectWithPathlines(flow, along, 0, {.time = 0.5, .steps = 8, .byAge = true});
    for (size_t k = 0; k < born.size(); ++k) CHECK(length(position(along, k) - position(born, k)) < 1e-6);
}

TEST_CASE("advect: particles at a moving wall have its normal velocity", "[track]") {
    const Vec3d velocity{{0.5, 0.2, 0}};
    const FlowInTime flow([&](double t) {
        return turning(
            t, {.sdf = placed(sphereSdf(0.5), Placement{.offset = velocity * t}), .side = Side::outside, .width = 0.3});
    });
    std::vector<Vec3d> points;
    for (const Vec3d& p : randomPoints(cube(1), 300, 4)) points.push_back(p * (0.501 / length(p)));
    Points particles = particlesAt(points);
    advect(flow, particles, 0, {.time = 0.05, .steps = 5});
    Worst worst;
    for (size_t k = 0; k < particles.size(); ++k) {
        const Vec3d outward = position(particles, k) - velocity * 0.05,
                    v{{particles.vx[k], particles.vy[k], particles.vz[k]}};
        const double distance = length(outward) - 0.5;
        if (distance < 0.01) worst.see(std::abs(dot(v - velocity, outward) / length(outward)), position(particles, k));
    }
    CAPTURE(worst.where);
    CHECK(worst.value < 0.1); // the speed of the flow is several times 1
}

TEST_CASE("advect: a wall that disappears or a non-finite time is an error", "[track]") {
    const FlowInTime flow([](double t) {
        const Flow bound = turning(0, {.sdf = sphereSdf(1), .side = Side::inside, .width = 0.2});
        return t < 0.5 ? bound : bound.within({.box = cube(1), .wall = {}});
    });
    Points particles = particlesAt({{{0, 0, 0}}});
    CHECK_THROWS_AS(advect(flow, particles, 0, {.time = 1, .steps = 4}), ValueError);
    CHECK_THROWS_AS(advect(flow, particles, std::nan(""), {.time = 1, .steps = 4}), ValueError);
}
