// SPDX-License-Identifier: Apache-2.0
// Longer than 400 lines: schemes, accuracy, walls, moments and damaged input of a single function.
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flows.h"
#include "curlew/track/Advect.h"
#include "curlew/track/Scatter.h"
#include "support/FiniteDifference.h"
#include "support/MovingPoints.h"
#include "support/Polynomial.h"

#include <limits>
#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

const Flow& sphereFlow() {
    static const Flow flow = boundFlow(sphereSdf(1), Side::inside);
    return flow;
}

/// A flow of analytic fields in a box that is large enough for these tests.
const Flow& smoothFlow() {
    static const Flow flow = withSpeed(Flow(sinesF(), sinesG(), {.box = cube(3), .wall = {}}), 1);
    return flow;
}

bool same(const Points& a, const Points& b) {
    return a.x == b.x && a.y == b.y && a.z == b.z && a.vx == b.vx && a.vy == b.vy && a.vz == b.vz && a.id == b.id &&
           a.f == b.f && a.g == b.g && a.converged == b.converged;
}

} // namespace

TEST_CASE("advect: particles stay on their tracks within the tolerance", "[track]") {
    const auto method = GENERATE(Reprojection::gaussNewton, Reprojection::newton);
    CAPTURE(static_cast<int>(method));
    const Flow& flow = sphereFlow();
    Points particles = scatter(flow.domain(), 2000, 1);
    const Points start = particles;
    // Each of Newton's alternating corrections reduces the residual by a factor only, so more iterations are allowed.
    const AdvectOptions options{
        .time = 1, .steps = 32, .reprojection = {.method = method, .tolerance = 1e-9, .iterations = 40}};
    const AdvectResult result = advect(flow, particles, options);
    const FlowRms rms = rmsOf(flow);
    double travelled = 0;
    for (size_t k = 0; k < particles.size(); ++k) {
        const Vec3d p = position(particles, k), from = position(start, k);
        const auto f = flow.f().at<0>(p).value, g = flow.g().at<0>(p).value;
        CAPTURE(k, from, p);
        REQUIRE(particles.id[k] == start.id[k]);
        REQUIRE(particles.f[k] == flow.f().at<0>(from).value);
        REQUIRE(particles.g[k] == flow.g().at<0>(from).value);
        // A point whose correction does not converge keeps its position, which is on the track as well.
        REQUIRE(std::abs(f - particles.f[k]) <= options.reprojection.tolerance * rms.potentials[0]);
        REQUIRE(std::abs(g - particles.g[k]) <= options.reprojection.tolerance * rms.potentials[1]);
        const Vec3d c = flow.at(p).velocity;
        REQUIRE(particles.vx[k] == static_cast<float>(c[0]));
        REQUIRE(particles.vy[k] == static_cast<float>(c[1]));
        REQUIRE(particles.vz[k] == static_cast<float>(c[2]));
        travelled += length(p - from);
    }
    CHECK(travelled / 2000 > 0.1);
    CHECK(result.points == 2000);
    CHECK(result.outside == 0);
    CHECK(result.residual[0] <= options.reprojection.tolerance);
    CHECK(result.residual[1] <= options.reprojection.tolerance);
    CHECK(result.notConverged < 20);
    CHECK(result.meanIterations > 0.5);
    // Without reprojection, the error is that of the integrator.
    Points free = start;
    CHECK(advect(flow, free, {.time = 1, .steps = 32, .reprojection = {.method = Reprojection::none}}).residual[0] >
          1e-6);
}

TEST_CASE("advect: no particle crosses a wall for any step size", "[track]") {
    struct Case {
        const char* name;
        Sdf sdf;
        Side side;
    };
    const auto c = GENERATE_REF(values<Case>({
        {"inside a sphere", sphereSdf(1), Side::inside},
        {"around a sphere", sphereSdf(1), Side::outside},
        {"both sides of a sphere", sphereSdf(1), Side::both},
        {"inside a torus", torusSdf(0.8, 0.35), Side::inside},
        {"around a torus", torusSdf(0.8, 0.35), Side::outside},
        {"both sides of a torus", torusSdf(0.8, 0.35), Side::both},
        {"inside a box", boxSdf({{1.6, 2, 1.2}}, 0.15), Side::inside},
        {"around a box", boxSdf({{1.6, 2, 1.2}}, 0.15), Side::outside},
        {"both sides of a box", boxSdf({{1.6, 2, 1.2}}, 0.15), Side::both},
    }));
    const Flow flow = boundFlow(c.sdf, c.side);
    const Points start = scatter(flow.domain(), 4000, 2);
    const auto distance = [&](const Points& p, size_t k) { return c.sdf.distance.at<0>(position(p, k)).value; };
    // Steps of 1/2 and 1/16 at a mean speed of 1: as long as the shape, and shorter than the layer. The third case has
    // adaptive steps with a low accuracy.
    const AdvectOptions rough{.time = 4, .scheme = Scheme::bogackiShampine, .accuracy = 0.1};
    for (const AdvectOptions& options : {AdvectOptions{.time = 4, .steps = 8, .scheme = Scheme::euler},
                                         {.time = 4, .steps = 64, .scheme = Scheme::euler},
                                         rough}) {
        const int steps = options.adaptive() ? 8 : options.steps;
        Points particles = start;
        const AdvectResult result = advect(flow, particles, options);
        size_t changed = 0;
        for (size_t k = 0; k < particles.size(); ++k)
            changed += (distance(particles, k) < 0) != (distance(start, k) < 0);
        CAPTURE(c.name, steps, result.notConverged, result.stalled, result.retries);
        CHECK(result.outside == 0);
        CHECK(countOutside(flow.domain(), particles) == 0);
        CHECK(changed == 0);
        // Particles move: only few steps are discarded.
        CHECK(result.stalled < start.size() * static_cast<size_t>(steps) / 20);
    }
    // Without reprojection particles do leak, so this setup tests the guard.
    Points free = start;
    advect(flow, free,
           {.time = 4, .steps = 8, .scheme = Scheme::euler, .reprojection = {.method = Reprojection::none}});
    size_t changed = 0;
    for (size_t k = 0; k < free.size(); ++k) changed += (distance(free, k) < 0) != (distance(start, k) < 0);
    CAPTURE(c.name);
    CHECK(changed > 20);
}

TEST_CASE("advect: no particle changes sides if its track exists on both", "[track]") {
    // Eq. 13 without separation: g has the same values inside and outside.
    const Wall wall{.sdf = sphereSdf(1), .side = Side::both, .width = 0.2};
    const ScalarField f = noiseField<Psrd3>({.seed = 1}),
                      g = bounded(noiseField<Psrd3>({.seed = 2}), wall, {.separate = false});
    const Flow flow = withSpeed(Flow(f, g, Domain::of(wall)), 1);
    const Points start = scatter(flow.domain(), 4000, 6);
    Points particles = start;
    const AdvectResult result = advect(flow, particles, {.time = 4, .steps = 8, .scheme = Scheme::euler});
    size_t changed = 0;
    for (size_t k = 0; k < start.size(); ++k)
        changed += (length(position(particles, k)) < 1) != (length(position(start, k)) < 1);
    CHECK(changed == 0);
    CHECK(result.outside == 0);
}

TEST_CASE("advect: no particle jumps through a wall thinner than its steps", "[track]") {
    // A plate too wide for particles to go around. The sign of y tells above from below. On both sides g has the same
    // sign, so the same tracks can exist.
    const Side side = GENERATE(Side::both, Side::outside);
    const double half = 0.01;
    const Wall wall{.sdf = boxSdf({{40, 2 * half, 40}}, 0.004), .side = side, .width = 0.1};
    const Flow flow = withSpeed(Flow(noiseField<Psrd3>({.seed = 3}), bounded(noiseField<Psrd3>({.seed = 4}), wall),
                                     {.box = {{{-1, -0.3, -1}}, {{1, 0.3, 1}}}, .wall = wall}),
                                1);
    std::vector<Vec3d> points;
    for (const Vec3d& p : randomPoints(Box{{{-1, -0.3, -1}}, {{1, 0.3, 1}}}, 6000, 5))
        if (std::abs(std::abs(p[1]) - half) > 1e-4 && (side == Side::both || std::abs(p[1]) > half))
            points.push_back(p);
    if (side == Side::both)
        for (const Vec3d& p : randomPoints(Box{{{-1, -0.9 * half, -1}}, {{1, 0.9 * half, 1}}}, 600, 6))
            points.push_back(p);
    const auto region = [&](const Vec3d& p) { return std::abs(p[1]) < half ? 0 : p[1] < 0 ? -1 : 1; };
    const auto jumps = [&](const AdvectOptions& options) {
        Points particles = particlesAt(points);
        const AdvectResult result = advect(flow, particles, options);
        size_t count = 0;
        for (size_t k = 0; k < points.size(); ++k) {
            const Vec3d p = position(particles, k);
            if (std::abs(p[0]) > 19 || std::abs(p[2]) > 19) FAIL("reached the edge of the plate");
            count += region(p) != region(points[k]);
        }
        if (options.reprojection.method != Reprojection::none) CHECK(result.outside == 0);
        return count;
    };
    for (const Scheme scheme : {Scheme::euler, Scheme::rk4})
        for (const int steps : {4, 16, 64}) {
            CAPTURE(static_cast<int>(side), static_cast<int>(scheme), steps);
            CHECK(jumps({.time = 2, .steps = steps, .scheme = scheme}) == 0);
        }
    CHECK(jumps({.time = 2, .steps = 4, .scheme = Scheme::euler, .reprojection = {.method = Reprojection::none}}) > 5);
}

TEST_CASE("advect: fixed steps do not depend on threads or order or other particles", "[track]") {
    const Flow& flow = sphereFlow();
    const AdvectOptions options{.time = 1, .steps = 10, .scheme = Scheme::midpoint};
    const Points start = scatter(flow.domain(), 1000, 3);
    Points one = start, two = start;
    AdvectResult resultOne, resultTwo;
    {
        const ThreadLimit limit(1);
        resultOne = advect(flow, one, options);
    }
    {
        const ThreadLimit limit(2);
        resultTwo = advect(flow, two, options);
    }
    CHECK(same(one, two));
    CHECK(resultOne.residual[0] == resultTwo.residual[0]);
    CHECK(resultOne.substeps == resultTwo.substeps);
    CHECK(resultOne.retries == resultTwo.retries);

    // 617 and 1000 are coprime: the permutation mixes the batches.
    std::vector<Vec3d> shuffled;
    for (size_t k = 0; k < 1000; ++k) shuffled.push_back(position(start, k * 617 % 1000));
    Points mixed = particlesAt(shuffled);
    advect(flow, mixed, options);
    for (size_t k = 0; k < 1000; ++k) {
        const size_t from = k * 617 % 1000;
        CAPTURE(k);
        REQUIRE(position(mixed, k) == position(one, from));
        REQUIRE(mixed.vx[k] == one.vx[from]);
        REQUIRE(mixed.converged[k] == one.converged[from]);
    }
    Points alone = particlesAt({position(start, 500)});
    advect(flow, alone, options);
    CHECK(position(alone, 0) == position(one, 500));
}

TEST_CASE("advect: the order in time is that of the scheme with and without reprojection", "[track]") {
    const auto reprojection = GENERATE(Reprojection::none, Reprojection::gaussNewton);
    const auto points = randomPoints(cube(1), 200, 7);
    const auto end = [&](Scheme scheme, int steps) {
        Points particles = particlesAt(points);
        advect(smoothFlow(), particles,
               {.time = 0.8,
                .steps = steps,
                .scheme = scheme,
                .reprojection = {.method = reprojection, .tolerance = 1e-13}});
        return particles;
    };
    // RK4 with 16 times as many steps serves as the exact solution. Its error is about 10^-10.
    const Points exact = end(Scheme::rk4, 512);
    const auto error = [&](Scheme scheme, int steps) {
        const Points particles = end(scheme, steps);
        std::vector<double> errors;
        for (size_t k = 0; k < points.size(); ++k)
            errors.push_back(length(position(particles, k) - position(exact, k)));
        return median(errors);
    };
    const std::array<std::pair<Scheme, double>, 4> schemes{
        {{Scheme::euler, 1}, {Scheme::midpoint, 2}, {Scheme::rk4, 4}, {Scheme::bogackiShampine, 3}}};
    for (const auto& [scheme, order] : schemes) {
        const double coarse = error(scheme, 16), fine = error(scheme, 32);
        CAPTURE(static_cast<int>(reprojection), order, coarse, fine, observedOrder(coarse, fine));
        CHECK(observedOrder(coarse, fine) > order - 0.2);
        // With reprojection a scheme can exceed its order, since only the error along the track remains.
        CHECK(observedOrder(coarse, fine) < order + 0.5);
    }
}

TEST_CASE("advect: follows a closed streamline known in closed form", "[track]") {
    // f = x² + y², g = z: a rotation by -2t. Reprojection keeps the radius. The angle has the phase error of RK4, (2
    // dt)^5 / 120 per step, which the projection does not change to leading order.
    const Flow flow(polynomial("x0**2 + x1**2"), polynomial("x2"), {.box = cube(1), .wall = {}});
    Points particles = particlesAt({{{1, 0, 0.5}}});
    const AdvectResult result =
        advect(flow, particles, {.time = 0.5, .steps = 50, .reprojection = {.tolerance = 1e-13}});
    const double tolerance = 50 * std::pow(2 * 0.01, 5) / 120 * 2 + 1e-12;
    CHECK(length(position(particles, 0) - Vec3d{{0.54030230586813977, -0.8414709848078965, 0.5}}) < tolerance);
    CHECK(result.substeps == 50);
    CHECK(result.retries == 0);
    CHECK(result.notConverged == 0);
}

TEST_CASE("advect: negative time returns to the start", "[track]") {
    const auto points = randomPoints(cube(1), 300, 8);
    const auto back = [&](int steps) {
        Points particles = particlesAt(points);
        AdvectOptions options{.time = 1, .steps = steps, .reprojection = {.tolerance = 1e-12}};
        advect(smoothFlow(), particles, options);
        options.time = -1;
        advect(smoothFlow(), particles, options);
        std::vector<double> errors;
        for (size_t k = 0; k < points.size(); ++k) errors.push_back(length(position(particles, k) - points[k]));
        return errors;
    };
    const double coarse = median(back(20)), fine = median(back(40));
    CAPTURE(coarse, fine, observedOrder(coarse, fine));
    CHECK(fine < 1e-5);
    CHECK(observedOrder(coarse, fine) > 3.8);
    // Half of the time back leads to another position.
    Points particles = particlesAt(points);
    advect(smoothFlow(), particles, {.time = -1, .steps = 20});
    CHECK(length(position(particles, 0) - points[0]) > 0.1);
}

TEST_CASE("advect: given f and g values are the track that is kept", "[track]") {
    // Particles that are slightly off their track move onto it in the first step.
    const Flow& flow = smoothFlow();
    const FlowRms rms = rmsOf(flow);
    Points particles = particlesAt(randomPoints(cube(0.5), 100, 9));
    for (size_t k = 0; k < 100; ++k) {
        particles.f.push_back(flow.f().at<0>(position(particles, k)).value + 1e-4 * rms.potentials[0]);
        particles.g.push_back(flow.g().at<0>(position(particles, k)).value - 1e-4 * rms.potentials[1]);
    }
    const Points start = particles;
    const AdvectResult result = advect(flow, particles, {.time = 0.1, .steps = 5});
    CHECK((particles.f == start.f && particles.g == start.g));
    CHECK(result.residual[0] <= 1e-8);
    size_t on = 0;
    for (size_t k = 0; k < 100; ++k)
        on += std::abs(flow.f().at<0>(position(particles, k)).value - start.f[k]) <= 1e-8 * rms.potentials[0];
    CHECK(on == 100 - result.notConverged);
    CHECK(result.notConverged < 10);
}

TEST_CASE("advect: particles that start beyond the wall stay and are counted", "[track]") {
    const Flow& flow = sphereFlow();
    const std::vector<Vec3d> points{{{0.5, 0, 0}}, {{1.5, 0, 0}}, {{0, 1, 0}}, {{0, 0.3, 0.2}}, {{0, 0, -7}}};
    Points particles = particlesAt(points);
    const AdvectResult result = advect(flow, particles, {.time = 0.5, .steps = 10});
    CHECK(result.outside == 3);
    for (const size_t k : {size_t{1}, size_t{2}, size_t{4}}) CHECK(position(particles, k) == points[k]);
    for (const size_t k : {size_t{0}, size_t{3}}) CHECK(position(particles, k) != points[k]);
    Points nan = particlesAt({{{std::nan(""), 0, 0}}, {{0.5, 0, 0}}});
    const AdvectResult strange = advect(flow, nan, {.time = 0.5, .steps = 10});
    CHECK(strange.outside == 1);
    CHECK(position(nan, 1) == position(particles, 0));
}

TEST_CASE("advect: a particle whose step finds no solution stays and is reported", "[track]") {
    // f and g are multiples of each other, and no point has the values of the track.
    const Flow flow(polynomial("x0"), polynomial("2*x0"), {.box = cube(1), .wall = {}});
    Points particles = particlesAt({{{0.1, 0, 0}}});
    particles.f = {0.5};
    particles.g = {0.5};
    const AdvectResult result = advect(flow, particles, {.time = 1, .steps = 3});
    CHECK(result.notConverged == 1);
    CHECK(result.stalled == 3);
    CHECK(result.substeps == 0);
    CHECK(particles.converged[0] == 0);
    CHECK(position(particles, 0) == Vec3d{{0.1, 0, 0}});
    // The mark persists in a later run.
    CHECK(advect(flow, particles, {.time = 0, .steps = 1}).notConverged == 1);
}

TEST_CASE("advect: particles of a flow without tracks move freely", "[track]") {
    // A vortex with core 10^4 about y rotates almost rigidly. With a uniform wind along its axis, paths are helices.
    const double turns = 0.25, rise = 0.4, time = 1;
    const Flow screw = vortexFlow(turns, 1e4, {.box = cube(2), .wall = {}}) + uniformFlow({{0, rise, 0}});
    const auto points = randomPoints(cube(1), 200, 11);
    Points particles = particlesAt(points);
    // Track values of another flow, which have no meaning here.
    particles.f.assign(points.size(), 1);
    particles.g.assign(points.size(), 2);
    const AdvectOptions options{.time = time, .steps = 50, .reprojection = {.method = Reprojection::none}};
    const AdvectResult result = advect(screw, particles, options);
    CHECK(result.notConverged == 0);
    CHECK(result.substeps == 50 * points.size());
    CHECK(result.residual[0] == 0);
    CHECK(result.residual[1] == 0);
    CHECK_FALSE(particles.hasTrack());
    Worst worst;
    for (size_t k = 0; k < points.size(); ++k) {
        const double angle = 2 * std::numbers::pi * turns * time, c = std::cos(angle), s = std::sin(angle);
        const Vec3d p = points[k], end{{c * p[0] + s * p[2], p[1] + rise * time, c * p[2] - s * p[0]}};
        worst.see(length(position(particles, k) - end), p);
    }
    // RK4's error is (angle of a step)^5 / 120 per step. The core changes the speed by a fraction of 2 10^-8.
    CAPTURE(worst.value, worst.where);
    CHECK(worst.value < 1e-7);
    CHECK(particles.vx.size() == points.size());

    // Without a wall, a sum is followed as a whole for any reprojection.
    AdvectOptions reprojecting = options;
    reprojecting.reprojection = {};
    Points again = particlesAt(points);
    CHECK(advect(screw, again, reprojecting).splitting == Splitting::none);
    CHECK(again.x == particles.x);
    CHECK(again.y == particles.y);
    // In a flow with tracks, the particles start new ones.
    const AdvectResult later = advect(smoothFlow(), particles, {.time = 0.1, .steps = 5});
    CHECK(particles.f.size() == points.size());
    CHECK(later.residual[0] <= 1e-8);
    // The order in time of a sum without symmetry.
    const Flow sum = curlFlow(std::array{sinesF(), sinesG(), sinesF() * sinesG()}, {.box = cube(3), .wall = {}});
    const auto end = [&](Scheme scheme, int steps) {
        Points p = particlesAt(points);
        advect(sum, p,
               {.time = 0.05, .steps = steps, .scheme = scheme, .reprojection = {.method = Reprojection::none}});
        return p;
    };
    const Points exact = end(Scheme::rk4, 512);
    for (const auto& [scheme, order] : {std::pair{Scheme::euler, 1.0}, {Scheme::midpoint, 2.0}, {Scheme::rk4, 4.0}}) {
        const auto error = [&, scheme = scheme](int steps) {
            const Points p = end(scheme, steps);
            std::vector<double> errors;
            for (size_t k = 0; k < points.size(); ++k) errors.push_back(length(position(p, k) - position(exact, k)));
            return median(errors);
        };
        const double observed = observedOrder(error(16), error(32));
        CAPTURE(order, observed);
        CHECK(observed > order - 0.2);
        CHECK(observed < order + 0.3);
    }
}

TEST_CASE("advect: particles of a normalised flow keep their tracks at one speed", "[track]") {
    const double speed = 2, time = 0.25;
    const Flow flow = smoothFlow().normalized(speed);
    const auto points = randomPoints(cube(1), 500, 12);
    Points particles = particlesAt(points);
    const AdvectResult result = advect(flow, particles, {.time = time, .steps = 100});
    const FlowRms rms = rmsOf(flow);
    CHECK(rms.speed == Approx(speed).epsilon(1e-12));
    CHECK(result.notConverged < 5);
    CHECK(result.residual[0] <= 1e-8);
    CHECK(result.residual[1] <= 1e-8);
    Worst drift, pace, chord;
    std::vector<double> ways;
    for (size_t k = 0; k < points.size(); ++k) {
        const Vec3d p = position(particles, k);
        const auto before = flow.at(points[k]).potentials, after = flow.at(p).potentials;
        for (size_t q = 0; q < 2; ++q) drift.see(std::abs(after[q] - before[q]) / rms.potentials[q], points[k]);
        const Vec3d v{{double{particles.vx[k]}, double{particles.vy[k]}, double{particles.vz[k]}}};
        pace.see(std::abs(length(v) / speed - 1), points[k]);
        chord.see(length(p - points[k]) / (speed * time), points[k]);
        ways.push_back(length(p - points[k]));
    }
    CAPTURE(drift.value, drift.where, pace.value, chord.value);
    CHECK(drift.value <= 1e-8 * (1 + 1e-9));
    CHECK(pace.value < 1e-6);      // velocities are floats
    CHECK(chord.value < 1 + 1e-4); // no chord is longer than the path
    CHECK(median(ways) > 0.7 * speed * time);
    // The streamlines are those of the original flow: each end point is on its track, to RK4's order in time.
    Points half = particlesAt(points);
    advect(flow, half, {.time = time, .steps = 200});
    std::vector<double> errors;
    for (size_t k = 0; k < points.size(); ++k) errors.push_back(length(position(half, k) - position(particles, k)));
    CHECK(median(errors) < 1e-6);
}

TEST_CASE("advect: empty input and zero time return the input", "[track]") {
    Points none;
    const AdvectResult result = advect(sphereFlow(), none, {});
    CHECK(result.points == 0);
    CHECK(result.substeps == 0);
    CHECK(result.residual[0] == 0);
    Points particles = scatter(sphereFlow().domain(), 100, 4);
    const Points start = particles;
    advect(sphereFlow(), particles, {.time = 0, .steps = 3});
    CHECK((particles.x == start.x && particles.y == start.y && particles.z == start.z));
    CHECK(particles.hasVelocity());
}

TEST_CASE("advect: invalid options are errors that name the value", "[track]") {
    Points particles = scatter(sphereFlow().domain(), 10, 5);
    const auto run = [&](const AdvectOptions& options) { advect(sphereFlow(), particles, options); };
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    CHECK_THROWS_WITH(run({.steps = -5}), Catch::ContainsSubstring("-5 steps"));
    // Schemes without an error estimate cannot be used with an accuracy.
    CHECK_THROWS_WITH(run({.scheme = Scheme::rk4}),
                      Catch::ContainsSubstring("rk4") && Catch::ContainsSubstring("rk45"));
    CHECK_THROWS_AS(run({.steps = 5, .scheme = Scheme::euler, .accuracy = 1e-3}), ValueError);
    for (const double bad : {-1e-3, std::nan(""), 1e-300}) CHECK_THROWS_AS(run({.accuracy = bad}), ValueError);
    for (const double bad : {kInfinity, -kInfinity, std::nan("")}) CHECK_THROWS_AS(run({.time = bad}), ValueError);
    for (const double bad : {0.0, -1e-9, std::nan("")})
        CHECK_THROWS_AS(run({.reprojection = {.tolerance = bad}}), ValueError);
    CHECK_THROWS_AS(run({.reprojection = {.iterations = 0}}), ValueError);
    CHECK_THROWS_AS(run({.reprojection = {.maxSubdivisions = -1}}), ValueError);
    CHECK_THROWS_AS(run({.reprojection = {.maxSubdivisions = 21}}), ValueError);
    CHECK_NOTHROW(run({.steps = 1, .reprojection = {.iterations = 1, .maxSubdivisions = 0}}));
    const Monitor cancelled{.report = {}, .cancelled = [] { return true; }};
    CHECK_THROWS_AS(advect(sphereFlow(), particles, {}, cancelled), Interrupted);
}

TEST_CASE("advect: preserves volume", "[track]") {
    // det(∂x(t)/∂x0) by central differences, which are of second order in h.
    const auto errorOf = [](const Flow& flow, const std::vector<Vec3d>& points, double h) {
        std::vector<Vec3d> around;
        for (const Vec3d& p : points)
            for (int axis = 0; axis < 3; ++axis)
                for (const double sign : {-1.0, 1.0}) around.push_back(p + unit(axis) * (sign * h));
        Points particles = particlesAt(around);
        advect(flow, particles, {.time = 0.3, .steps = 60, .reprojection = {.tolerance = 1e-13}});
        std::vector<double> errors;
        for (size_t k = 0; k < points.size(); ++k) {
            std::array<Vec3d, 3> columns;
            for (size_t axis = 0; axis < 3; ++axis)
                columns[axis] =
                    (position(particles, 6 * k + 2 * axis + 1) - position(particles, 6 * k + 2 * axis)) * (0.5 / h);
            errors.push_back(std::abs(dot(columns[0], cross(columns[1], columns[2])) - 1));
        }
        return median(errors);
    };
    const auto points = randomPoints(cube(0.5), 200, 10);
    SECTION("analytic fields") {
        const double coarse = errorOf(smoothFlow(), points, 4e-3), fine = errorOf(smoothFlow(), points, 2e-3);
        CAPTURE(coarse, fine, observedOrder(coarse, fine));
        CHECK(observedOrder(coarse, fine) > 1.8);
        CHECK(fine < 1e-4);
    }
    SECTION("bounded noise") {
        const double coarse = errorOf(sphereFlow(), points, 4e-3), fine = errorOf(sphereFlow(), points, 1e-3);
        CAPTURE(coarse, fine);
        CHECK(fine < coarse / 3); // the flow map is only C¹: first order at least
        CHECK(fine < 1e-3);
    }
}

TEST_CASE("advect: positions alone move exactly as particles do", "[track]") {
    const Flow& flow = sphereFlow();
    Points particles = scatter(flow.domain(), 300, 3);
    std::vector<Vec3d> points;
    for (size_t k = 0; k < particles.size(); ++k) points.push_back(position(particles, k));
    const AdvectOptions options{.time = 0.7, .steps = 5};
    const AdvectResult a = advect(flow, particles, options), b = advect(flow, points, options);
    for (size_t k = 0; k < particles.size(); ++k) REQUIRE(points[k] == position(particles, k));
    // The sums are formed in another order.
    for (size_t q = 0; q < 2; ++q) CHECK(a.residual[q] == Approx(b.residual[q]).epsilon(1e-12));
    CHECK(a.substeps == b.substeps);
}

TEST_CASE("advect: points stay inside a disc in 2D for any step size", "[track]") {
    const WallN<2> wall{.sdf = sphereSdf<2>(1), .side = Side::inside, .width = 0.2};
    const FlowN<2> flow =
        withSpeed(FlowN<2>({bounded(noiseField<Psrd2>({.seed = 1}, {.frequency = 2}), wall)}, DomainN<2>::of(wall)), 1);
    std::vector<Vec<double, 2>> points;
    for (const auto& p : randomPoints(cube<2>(1), 2000, 4))
        if (length(p) < 0.999) points.push_back(p);
    const auto start = points;
    const auto result = advect(flow, points, {.time = 3, .steps = 4, .scheme = Scheme::euler});
    CHECK(result.outside == 0);
    CHECK(result.notConverged == 0);
    CHECK(result.residual[0] <= 1e-8);
    size_t moved = 0;
    for (size_t k = 0; k < points.size(); ++k) {
        REQUIRE(length(points[k]) < 1);
        moved += length(points[k] - start[k]) > 0.1;
    }
    CHECK(moved > points.size() / 2);
}

TEMPLATE_TEST_CASE_SIG("advect: points stay on their tracks in every dimension", "[track]", ((int N), N), 2, 4, 5, 7) {
    typename FlowN<N>::Potentials potentials = [&]<size_t... K>(std::index_sequence<K...>) {
        return typename FlowN<N>::Potentials{noiseField<SimplexNoise<N>>({.seed = K + 1})...};
    }
    (std::make_index_sequence<size_t{N - 1}>());
    const FlowN<N> flow = withSpeed(FlowN<N>(std::move(potentials)), 1);
    auto points = randomPoints(cube<N>(1), 200, 5);
    const auto start = points;
    const auto result = advect(flow, points, {.time = 0.5, .steps = 10});
    CAPTURE(result.notConverged, result.retries, result.substeps);
    CHECK(result.points == 200);
    // If the gradients of N - 1 noises are nearly dependent, the track is ill-defined, and the point waits.
    CHECK(result.notConverged <= 4);
    double moved = 0;
    for (size_t q = 0; q < result.residual.size(); ++q) CHECK(result.residual[q] <= 1e-8);
    for (size_t k = 0; k < points.size(); ++k) moved += length(points[k] - start[k]);
    CHECK(moved / 200 > 0.05);
}

TEST_CASE("advect: adaptive steps meet the accuracy with no more steps than needed", "[track]") {
    const auto reprojection = GENERATE(Reprojection::none, Reprojection::gaussNewton);
    const auto scheme = GENERATE(Scheme::bogackiShampine, Scheme::dormandPrince);
    const auto points = randomPoints(cube(1), 200, 7);
    Points exact = particlesAt(points);
    advect(smoothFlow(), exact, {.time = 2, .steps = 2000, .reprojection = {.tolerance = 1e-13}});
    const auto run = [&](double accuracy) {
        Points particles = particlesAt(points);
        const auto result = advect(smoothFlow(), particles,
                                   {.time = 2,
                                    .scheme = scheme,
                                    .reprojection = {.method = reprojection, .tolerance = 1e-12},
                                    .accuracy = accuracy});
        std::vector<double> errors;
        for (size_t k = 0; k < points.size(); ++k)
            errors.push_back(length(position(particles, k) - position(exact, k)));
        CHECK(result.coarse == 0);
        CHECK(result.notConverged == 0);
        return std::pair(median(errors), static_cast<double>(result.substeps));
    };
    const auto [rough, few] = run(1e-3);
    const auto [fine, many] = run(1e-6);
    CAPTURE(static_cast<int>(reprojection), static_cast<int>(scheme), rough, fine, few, many);
    CHECK(rough < 1e-2);
    CHECK(fine < rough / 30);
    // A thousandth of the error per step takes about 1000^(1/3) = 10 times as many steps, or 1000^(1/5) = 4 times.
    const double expected = std::pow(1000, 1.0 / tableauOf(scheme).errorOrder);
    CHECK(many / few > 0.3 * expected);
    CHECK(many / few < 1.4 * expected);
    CHECK(few < 40.0 * static_cast<double>(points.size()));
}

TEST_CASE("advect: steps too long that cannot be subdivided are counted as coarse", "[track]") {
    Points particles = particlesAt(randomPoints(cube(1), 100, 7));
    const AdvectResult result = advect(
        smoothFlow(), particles, {.time = 2, .steps = 1, .reprojection = {.maxSubdivisions = 2}, .maxStep = 1e-3});
    CHECK(result.coarse > 300); // of 400 steps
    CHECK(result.stalled == 0);
}

TEST_CASE("advect: with byAge, newborn particles move only since their birth", "[track]") {
    const auto points = randomPoints(cube(1), 100, 7);
    Points whole = particlesAt(points), half = whole, aged = whole;
    const AdvectOptions options{.time = 0.4, .steps = 4, .byAge = true};
    advect(smoothFlow(), whole, options); // without ages
    aged.age.assign(points.size(), 0.2f);
    aged.age[0] = 7;
    aged.age[1] = 0;
    advect(smoothFlow(), aged, options);
    advect(smoothFlow(), half, {.time = static_cast<double>(0.2f), .steps = 4});
    CHECK(position(aged, 0) == position(whole, 0));
    CHECK(position(aged, 1) == points[1]);
    for (size_t k = 2; k < points.size(); ++k) CHECK(length(position(aged, k) - position(half, k)) < 1e-12);
}

TEST_CASE("advect: no step is longer than maxStep", "[track]") {
    const AdvectOptions options = GENERATE(AdvectOptions{.time = 1, .steps = 2},
                                           AdvectOptions{.time = 1, .scheme = Scheme::bogackiShampine, .accuracy = 1});
    const auto points = randomPoints(cube(1), 100, 7);
    const auto run = [&](double maxStep) {
        Points particles = particlesAt(points);
        AdvectOptions held = options;
        held.maxStep = maxStep;
        const AdvectResult result = advect(smoothFlow(), particles, held);
        CHECK(result.coarse == 0);
        return result.substeps;
    };
    // The mean speed is 1, which gives the minimum number of steps for all particles together.
    const size_t free = run(0), held = run(0.05);
    CAPTURE(options.adaptive(), free, held);
    CHECK(free < 400);
    CHECK(held > 100 * 10);
    CHECK_THROWS_AS(run(-1), ValueError);
    CHECK_THROWS_AS(run(std::nan("")), ValueError);
}

TEST_CASE("advect: no step passes through a wall whose distance grows faster than the way to it", "[track]") {
    Sdf ball = sphereSdf(0.565);
    ball.distance = 4.0 * ball.distance;
    ball.lipschitz = 4;
    const Domain domain{.box = cube(2), .wall = Wall{.sdf = ball, .side = Side::outside, .width = 3}};
    const Vec3d from{{0, 0.84, 0}}, to{{0.565, 0.06, 0}}; // both outside, 0.07 deep between them
    Points particles = particlesAt({from});
    const AdvectResult result = advect(uniformFlow(to - from, domain), particles, {.time = 1, .steps = 1});
    CHECK(result.retries > 0);
    CHECK(result.notConverged == 1);
    CHECK(position(particles, 0)[1] > 0.3);
}

TEST_CASE("advect: f and g do not drift over thousands of steps", "[track]") {
    Points particles = scatter(sphereFlow().domain(), 64, 3);
    const Points start = particles;
    const AdvectResult result = advect(sphereFlow(), particles, {.time = 20, .steps = 2000});
    const FlowRms rms = rmsOf(sphereFlow());
    double squares = 0;
    for (size_t k = 0; k < particles.size(); ++k) {
        const double f =
            sphereFlow().f().at<0>(position(particles, k)).value - sphereFlow().f().at<0>(position(start, k)).value;
        const double g =
            sphereFlow().g().at<0>(position(particles, k)).value - sphereFlow().g().at<0>(position(start, k)).value;
        squares = std::max({squares, std::abs(f) / rms.potentials[0], std::abs(g) / rms.potentials[1]});
    }
    CHECK(result.notConverged == 0);
    CHECK(squares <= 1e-6);
}

namespace {

/// Returns the mean and the greatest distance between two sets of points.
std::pair<double, double> apart(const Points& a, const Points& b) {
    double sum = 0, most = 0;
    for (size_t k = 0; k < a.size(); ++k) {
        const double distance = length(position(a, k) - position(b, k));
        sum += distance;
        most = std::max(most, distance);
    }
    return {sum / static_cast<double>(a.size()), most};
}

} // namespace

TEST_CASE("advect: the default accuracy holds however the time is split into calls", "[track]") {
    const Flow& flow = sphereFlow();
    const Points start = scatter(flow.domain(), 500, 7);
    const double size = 2;
    Points exact = start;
    advect(flow, exact, {.time = 2, .reprojection = {.tolerance = 1e-12}, .accuracy = 1e-11});
    for (const int calls : {1, 48, 96, 192}) {
        Points particles = start;
        AdvectResult result;
        for (int k = 0; k < calls; ++k) result += advect(flow, particles, {.time = 2.0 / calls});
        const auto [mean, most] = apart(particles, exact);
        CAPTURE(calls, mean, most, result.errorMean, result.errorMax, result.substeps);
        CHECK(mean < 1e-4 * size);
        CHECK(most < 1e-2 * size);
        CHECK(result.outside == 0);
        CHECK(result.notConverged == 0);
        CHECK(result.coarse == 0);
        // The sum of the steps' error estimates has the magnitude of the measured error.
        CHECK(result.errorMean > 0.01 * mean);
        CHECK(result.errorMax < 1e-3 * size);
    }
}

TEST_CASE("advect: adaptive steps do not depend on threads or other particles", "[track]") {
    const double accuracy = GENERATE(0.0, 1e-3); // the default; and stages in float
    const Flow& flow = sphereFlow();
    const Points start = scatter(flow.domain(), 500, 3);
    Points one = start, two = start;
    {
        const ThreadLimit limit(1);
        advect(flow, one, {.time = 1, .accuracy = accuracy});
    }
    {
        const ThreadLimit limit(2);
        advect(flow, two, {.time = 1, .accuracy = accuracy});
    }
    CHECK(same(one, two));
    Points alone = particlesAt({position(start, 250)});
    advect(flow, alone, {.time = 1, .accuracy = accuracy});
    CHECK(position(alone, 0) == position(one, 250));
}

TEST_CASE("advect: coarse steps move particles of potentials beyond the range of float, too", "[track]") {
    const auto moved = [](double amplitude) {
        const auto noise = [&](uint64_t seed) { return amplitude * noiseField<Psrd3>({.seed = seed}, {}); };
        const Flow flow = withSpeed(Flow(noise(1), noise(2), {.box = cube(1), .wall = {}}), 1);
        Points particles = scatter(flow.domain(), 50, 3);
        const AdvectResult result = advect(flow, particles, {.time = 1, .accuracy = 1e-3});
        CHECK(result.notConverged == 0);
        return particles;
    };
    const Points usual = moved(1), small = moved(1e-25), large = moved(1e22);
    // Stages in float, or in double: they differ by far less than the errors of a few steps of this accuracy.
    for (size_t k = 0; k < usual.size(); ++k) {
        CHECK(length(position(usual, k) - position(small, k)) < 0.01);
        CHECK(length(position(usual, k) - position(large, k)) < 0.01);
    }
}

TEST_CASE("advect: the default accuracy does not depend on units", "[track]") {
    // The same flow in other units of length and time. The factors are powers of two, so that it is equal to rounding.
    const auto moved = [](double length, double time) {
        const Wall wall{.sdf = sphereSdf(length), .side = Side::inside, .width = 0.2 * length};
        const ScalarField f = noiseField<Psrd3>({.seed = 1}, {.frequency = 1.5 / length}),
                          g = bounded(noiseField<Psrd3>({.seed = 2}, {.frequency = 1.5 / length}), wall);
        const Flow flow = withSpeed(Flow(f, g, Domain::of(wall)), length / time);
        Points particles = particlesAt({{{0.3 * length, 0.2 * length, -0.1 * length}}, {{-0.5 * length, 0, 0}}});
        const AdvectResult result = advect(flow, particles, {.time = 2 * time});
        CHECK(result.errorMean > 0);
        return result.substeps;
    };
    const size_t steps = moved(1, 1);
    CHECK(steps > 10);
    CHECK(moved(1024, 1) == steps);
    CHECK(moved(1, 1024) == steps);
    CHECK(moved(1.0 / 64, 1.0 / 16) == steps);
}

TEST_CASE("advect: the accuracy bounds the position error up to a factor", "[track]") {
    // In a rotation, the error is an error of the angle, and nothing is stretched.
    const Flow flow(polynomial("x0**2 + x1**2"), polynomial("x2"), {.box = cube(1), .wall = {}});
    const double accuracy = GENERATE(1e-4, 1e-6, 1e-8);
    const double time = 3;
    Points particles = particlesAt({{{1, 0, 0.5}}});
    const AdvectResult result = advect(flow, particles, {.time = time, .accuracy = accuracy});
    const double error = length(position(particles, 0) - Vec3d{{std::cos(2 * time), -std::sin(2 * time), 0.5}});
    CAPTURE(accuracy, error, result.errorMean, result.substeps);
    // The estimate is that of the lower-order solution, so the position is more accurate.
    CHECK(error < result.errorMean);
    CHECK(result.errorMean <= accuracy * static_cast<double>(result.substeps));
    CHECK(result.errorMean > 0.02 * accuracy * static_cast<double>(result.substeps));
    CHECK(result.errorMax == result.errorMean);
}

TEST_CASE("advect: without subdivision steps follow ICN Algorithm 1", "[track]") {
    const Flow& flow = sphereFlow();
    const Points start = scatter(flow.domain(), 500, 8);
    Points particles = start;
    const AdvectOptions printed{.time = 0.5, .steps = 50, .reprojection = {.iterations = 1, .maxSubdivisions = 0}};
    const AdvectResult result = advect(flow, particles, printed);
    CHECK(result.substeps > 500 * 49); // the wall discards a few steps
    CHECK(result.retries == 0);
    CHECK(result.meanIterations <= 1);
    CHECK(result.meanIterations > 0.2); // below one, since some steps need no correction
    CHECK(result.outside == 0);
    const auto [moved, most] = apart(particles, start);
    CHECK(moved > 0.1);
    // One correction per step keeps particles near their tracks.
    CHECK(result.residual[0] > 0);
    CHECK(result.residual[0] < 1e-3);
    // If no step is taken, the mean number of corrections is 0, not infinite.
    Points beyond = particlesAt({{{5, 0, 0}}});
    CHECK(advect(flow, beyond, printed).meanIterations == 0);
}
