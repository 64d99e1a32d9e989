// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flows.h"
#include "curlew/track/Advect.h"
#include "curlew/track/Loop.h"
#include "curlew/track/Scatter.h"
#include "support/FiniteDifference.h"
#include "support/MovingPoints.h"
#include "support/Polynomial.h"

#include <limits>
#include <numbers>

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;

namespace {

constexpr double kPi = std::numbers::pi;

const Flow& ballFlow() {
    static const Flow flow = boundFlow(sphereSdf(1), Side::inside);
    return flow;
}

/// Full circles about the z axis with the angular velocity 2: f = x² + y², g = z, in a ball.
Flow circles() {
    const Wall wall{.sdf = sphereSdf(1), .side = Side::inside, .width = 0.2};
    return Flow(polynomial("x0**2 + x1**2"), polynomial("x2"), Domain::of(wall));
}

bool same(const Points& a, const Points& b) {
    return a.x == b.x && a.y == b.y && a.z == b.z && a.vx == b.vx && a.vy == b.vy && a.vz == b.vz && a.id == b.id &&
           a.f == b.f && a.g == b.g && a.fade == b.fade && a.converged == b.converged;
}

/// Options of a loop with this duration.
LoopOptions during(double seconds) { return {.duration = seconds, .accuracy = 1e-6}; }

} // namespace

TEST_CASE("LoopedPoints: particles on circles complete whole rounds at the expected angles", "[track]") {
    const Flow flow = circles();
    const Points seeds = scatter(flow.domain(), 200, 1);
    const double period = kPi; // the angular velocity is 2
    const double rounds = GENERATE(0.76, 1.0, 1.4, 1.6, 3.3, 12.7);
    const double duration = rounds * period, k = std::max(1.0, std::round(rounds));
    const LoopedPoints loops(flow, seeds, during(duration));
    CAPTURE(rounds);
    REQUIRE(loops.summary().closed == seeds.size());
    CHECK(loops.summary().gapMax < 1e-7);
    const Vec3d spin = flow.at({{1, 0, 0}}).velocity;
    REQUIRE(std::abs(spin[1]) == Approx(2));
    for (const double time : {0.0, 0.01, 0.3, 0.77, 1.9}) {
        const LoopMoment moment = loops.at(time);
        CHECK(moment.snapped == 0);
        CHECK(moment.outside == 0);
        const double angle = std::copysign(2 * kPi * k * time / duration, spin[1]);
        for (size_t n = 0; n < seeds.size(); ++n) {
            const Vec3d from = position(seeds, n), p = position(moment.points, n);
            const Vec3d expected{{from[0] * std::cos(angle) - from[1] * std::sin(angle),
                                  from[0] * std::sin(angle) + from[1] * std::cos(angle), from[2]}};
            CAPTURE(n, time, from, p, expected);
            REQUIRE(loops.period(n) == Approx(period).epsilon(1e-5));
            REQUIRE(loops.pace(n) == Approx(k / rounds).epsilon(1e-5));
            REQUIRE(length(p - expected) < 1e-5);
            REQUIRE(moment.points.fade[n] == 1);
            const Vec3d v = flow.at(p).velocity * (k / rounds);
            REQUIRE(static_cast<double>(moment.points.vx[n]) == Approx(v[0]).margin(1e-5));
            REQUIRE(static_cast<double>(moment.points.vy[n]) == Approx(v[1]).margin(1e-5));
        }
    }
}

TEST_CASE("LoopedPoints: positions repeat exactly after any number of loops", "[track]") {
    const uint64_t seed = GENERATE(range(1, 6));
    const Points seeds = scatter(ballFlow().domain(), 300, seed);
    const LoopedPoints loops(ballFlow(), seeds, {.duration = 1.1});
    const Points begin = loops.at(0).points;
    CHECK(begin.x == seeds.x);
    CHECK(begin.y == seeds.y);
    CHECK(begin.z == seeds.z);
    CHECK(begin.id == seeds.id);
    for (const double end : {1.1, 2.2, -1.1, 33 / 30.0, 110.0}) CHECK(same(loops.at(end).points, begin));
    // Frames of 1/30 s, one loop and a hundred loops later.
    for (int frame = 1; frame < 33; ++frame) {
        const Points now = loops.at(frame / 30.0).points;
        CAPTURE(seed, frame);
        CHECK(same(loops.at((frame + 33) / 30.0).points, now));
        CHECK(same(loops.at((frame + 3300) / 30.0).points, now));
        CHECK(!same(now, begin));
    }
}

TEST_CASE("LoopedPoints: no particle leaves the domain and the pace is between 2/3 and 4/3", "[track]") {
    struct Case {
        const char* name;
        Sdf sdf;
        Side side;
    };
    const auto c = GENERATE_REF(values<Case>({{"in a sphere", sphereSdf(1), Side::inside},
                                              {"in a torus", torusSdf(0.8, 0.35), Side::inside},
                                              {"on both sides of a box", boxSdf({{1.6, 2, 1.2}}, 0.15), Side::both},
                                              {"around a sphere", sphereSdf(1), Side::outside}}));
    const Flow flow = boundFlow(c.sdf, c.side);
    const Points seeds = scatter(flow.domain(), 500, 3);
    const double duration = GENERATE(0.7, 3.0);
    const LoopedPoints loops(flow, seeds, {.duration = duration, .accuracy = 1e-3});
    const LoopSummary& s = loops.summary();
    CAPTURE(c.name, duration, s.closed, s.fading, s.still, s.stuck);
    CHECK(s.points == seeds.size());
    CHECK(s.closed + s.fading + s.still == seeds.size());
    CHECK(s.closed > 50);
    CHECK(s.fading > 10);
    CHECK(s.paceMin >= 2.0 / 3);
    CHECK(s.paceMax <= 4.0 / 3);
    size_t closed = 0;
    for (size_t n = 0; n < seeds.size(); ++n) {
        closed += loops.kind(n) == LoopKind::closed;
        if (loops.kind(n) != LoopKind::closed) {
            CHECK(loops.pace(n) == 1);
            continue;
        }
        const double T = loops.period(n);
        REQUIRE(T <= duration * 4 / 3 * (1 + 1e-9));
        REQUIRE(loops.pace(n) == Approx(std::max(1.0, std::round(duration / T)) * T / duration));
    }
    CHECK(closed == s.closed);
    const FlowRms rms = rmsOf(flow);
    for (int frame = 0; frame <= 24; ++frame) {
        const LoopMoment moment = loops.at(duration * frame / 24);
        CAPTURE(frame, moment.snapped);
        CHECK(moment.outside == 0);
        CHECK(countOutside(flow.domain(), moment.points) == 0);
        CHECK(moment.snapped <= seeds.size() / 50);
        for (size_t n = 0; n < seeds.size(); ++n) {
            const Vec3d p = position(moment.points, n);
            CAPTURE(n, p);
            // It stays on the side and on the track of its seed.
            REQUIRE((c.sdf.distance.at<0>(p).value < 0) == (c.sdf.distance.at<0>(position(seeds, n)).value < 0));
            REQUIRE(std::abs(flow.f().at<0>(p).value - moment.points.f[n]) <= 1e-8 * rms.potentials[0]);
            REQUIRE(std::abs(flow.g().at<0>(p).value - moment.points.g[n]) <= 1e-8 * rms.potentials[1]);
        }
    }
}

TEST_CASE("LoopedPoints: particles on tracks too long for the loop fade at the pace of the flow", "[track]") {
    const Flow flow = circles();
    const Points seeds = scatter(flow.domain(), 100, 2);
    const double duration = 0.74 * kPi; // would need a pace above 4/3
    const LoopedPoints loops(flow, seeds, during(duration));
    REQUIRE(loops.summary().fading == seeds.size());
    CHECK(loops.summary().stuck == 0);
    const int frames = 200;
    std::vector<float> least(seeds.size(), 1), most(seeds.size(), 0);
    std::vector<int> jumps(seeds.size(), 0);
    size_t seen = 0;
    Points before = loops.at(0).points;
    CHECK(before.x == seeds.x);
    for (int frame = 1; frame <= frames; ++frame) {
        const Points now = loops.at(duration * frame / frames).points;
        for (size_t n = 0; n < seeds.size(); ++n) {
            least[n] = std::min(least[n], now.fade[n]);
            most[n] = std::max(most[n], now.fade[n]);
            seen += now.fade[n] == 1;
            const Vec3d move = position(now, n) - position(before, n);
            const double radius = std::hypot(seeds.x[n], seeds.y[n]), arc = 2 * duration / frames * radius;
            CAPTURE(n, frame, length(move), arc);
            // A particle moves along an arc, except for restarts, which are invisible.
            if (length(move) < 1.01 * arc) continue;
            REQUIRE(now.fade[n] < 0.01F);
            REQUIRE(before.fade[n] < 0.01F);
            ++jumps[n];
        }
        before = now;
    }
    for (size_t n = 0; n < seeds.size(); ++n) {
        CAPTURE(n);
        CHECK(least[n] < 0.01F);
        CHECK(most[n] == 1);
        CHECK(jumps[n] <= 1);
    }
    // A particle is fully visible half of the time, and restarts are spread over the loop.
    CHECK(static_cast<double>(seen) / (frames * 100.0) == Approx(0.5).margin(0.02));
}

TEST_CASE("LoopedPoints: agrees with advect and converges with the accuracy", "[track]") {
    const Points seeds = scatter(ballFlow().domain(), 300, 5);
    const double duration = 1.5;
    const double accuracy = GENERATE(1e-3, 1e-5);
    const LoopedPoints loops(ballFlow(), seeds, {.duration = duration, .accuracy = accuracy});
    double mean = 0;
    size_t count = 0;
    for (const double part : {0.13, 0.4, 0.8}) {
        const Points there = loops.at(part * duration).points;
        Points moved = seeds; // each particle for its own time
        for (size_t n = 0; n < seeds.size(); ++n)
            moved.age.push_back(static_cast<float>(
                loops.kind(n) == LoopKind::closed ? std::fmod(part * duration * loops.pace(n), loops.period(n)) : 0));
        advect(ballFlow(), moved, {.time = 2, .steps = 2000, .reprojection = {.tolerance = 1e-10}, .byAge = true});
        for (size_t n = 0; n < seeds.size(); ++n) {
            if (loops.kind(n) != LoopKind::closed) continue;
            mean += length(position(moved, n) - position(there, n));
            ++count;
        }
    }
    mean /= static_cast<double>(count);
    CAPTURE(accuracy, count);
    // The accuracy applies to a step, and the errors of some tens of steps add up. Measured are 0.9 and 1.5 times the
    // accuracy.
    CHECK(mean < 4 * accuracy);
}

TEST_CASE("LoopedPoints: does not depend on threads or other particles", "[track]") {
    const Points seeds = scatter(ballFlow().domain(), 700, 6);
    const LoopOptions options{.duration = 1};
    const Points all = LoopedPoints(ballFlow(), seeds, options).at(0.37).points;
    Points few = seeds, expected = all;
    std::vector<uint8_t> flags(seeds.size());
    for (size_t n = 0; n < flags.size(); ++n) flags[n] = n % 3 == 0 ? 1 : 0;
    few.remove(flags), expected.remove(flags);
    CHECK(same(LoopedPoints(ballFlow(), few, options).at(0.37).points, expected));
    const ThreadLimit one(1);
    CHECK(same(LoopedPoints(ballFlow(), seeds, options).at(0.37).points, all));
}

TEST_CASE("LoopedPoints: particles that cannot move stay in place", "[track]") {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    Points seeds = particlesAt({{{2, 0, 0}}, {{nan, 0, 0}}, {{0.3, 0.1, 0}}, {{0, 0, 0.2}}});
    const Flow flow = circles(); // the flow is zero on its axis
    const LoopedPoints loops(flow, seeds, during(4));
    CHECK(loops.summary().outside == 2);
    CHECK(loops.summary().still == 3);
    CHECK(loops.kind(2) == LoopKind::closed);
    const LoopMoment moment = loops.at(1);
    CHECK(moment.outside == 2);
    CHECK(position(moment.points, 0) == position(seeds, 0));
    CHECK(std::isnan(moment.points.x[1]));
    CHECK(position(moment.points, 3) == position(seeds, 3));
    CHECK(moment.points.vx[0] == 0);
    CHECK(moment.points.fade == std::vector<float>(4, 1));
    CHECK(LoopedPoints(flow, {}, during(1)).at(0.5).points.size() == 0);
}

TEST_CASE("LoopedPoints: tracks with too many vertices are truncated and fade", "[track]") {
    const Points seeds = scatter(ballFlow().domain(), 100, 7);
    const LoopedPoints loops(ballFlow(), seeds, {.duration = 4, .accuracy = 1e-6, .vertices = 20});
    CHECK(loops.summary().truncated > 50);
    CHECK(loops.summary().vertices < 100 * 41);
    CHECK(same(loops.at(4).points, loops.at(0).points));
    for (const double time : {0.3, 1.0, 2.0, 3.7}) CHECK(countOutside(ballFlow().domain(), loops.at(time).points) == 0);
}

TEST_CASE("LoopedPoints: unsuitable flows and options are refused", "[track]") {
    const Points seeds = particlesAt({{{0.1, 0, 0}}});
    const Flow free(noiseField<Psrd3>({.seed = 1}), noiseField<Psrd3>({.seed = 2}), {.box = cube(1), .wall = {}});
    CHECK_THROWS_WITH(LoopedPoints(free, seeds, {}), ContainsSubstring("no wall") && ContainsSubstring("bound"));
    CHECK_THROWS_WITH(LoopedPoints(ballFlow() + ballFlow(), seeds, {}), ContainsSubstring("no tracks"));
    CHECK_THROWS_WITH(LoopedPoints(ballFlow(), seeds, {.reprojection = {.method = Reprojection::none}}),
                      ContainsSubstring("reprojection"));
    CHECK_THROWS_WITH(LoopedPoints(ballFlow(), seeds, {.duration = 0}), ContainsSubstring("duration"));
    for (const double bad : {-1.0, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
        CHECK_THROWS_WITH(LoopedPoints(ballFlow(), seeds, {.duration = bad}), ContainsSubstring("duration"));
        CHECK_THROWS_WITH(LoopedPoints(ballFlow(), seeds, {.accuracy = bad}), ContainsSubstring("accuracy"));
    }
    const LoopedPoints loops(ballFlow(), seeds, {});
    CHECK_THROWS_AS(loops.at(std::numeric_limits<double>::infinity()), ValueError);
    CHECK_THROWS_AS(LoopedPoints(ballFlow(), seeds, {}, {.report = {}, .cancelled = [] { return true; }}), Interrupted);
}
