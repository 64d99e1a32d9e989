// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flows.h"
#include "curlew/track/Scatter.h"
#include "curlew/track/Trace.h"
#include "support/FiniteDifference.h"
#include "support/MovingPoints.h"
#include "support/Polynomial.h"
#include "support/Reference.h"

#include <limits>
#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

constexpr double kPi = std::numbers::pi;

Points seedsAt(const std::vector<Vec3d>& points) { return particlesAt(points, 100); }

const Flow& ballFlow() {
    static const Flow flow = boundFlow(sphereSdf(1), Side::inside);
    return flow;
}

/// Circles about the y axis, in a box that contains them.
Flow circles() { return vortexFlow(1, 0.5, {.box = cube(2), .wall = {}}); }

double radius(const Vec3d& p) { return std::hypot(p[0], p[2]); }

bool same(const Curves& a, const Curves& b) {
    return a.x == b.x && a.y == b.y && a.z == b.z && a.vx == b.vx && a.vy == b.vy && a.vz == b.vz && a.f == b.f &&
           a.g == b.g && a.along == b.along && a.start == b.start && a.id == b.id && a.upstream == b.upstream &&
           a.downstream == b.downstream && a.length == b.length && a.gap == b.gap;
}

} // namespace

TEST_CASE("trace: circles close with the correct length in each direction and step mode", "[track]") {
    const auto by = GENERATE(StepBy::length, StepBy::time);
    const auto direction = GENERATE(Direction::forward, Direction::backward, Direction::both);
    const Points seeds = seedsAt(randomPoints(cube(1), 100, 1));
    const TraceResult result = trace(circles(), seeds, {.by = by, .direction = direction});
    const Curves& c = result.curves;
    CAPTURE(static_cast<int>(by), static_cast<int>(direction), result.gapMax);
    REQUIRE(c.size() == 100);
    CHECK(result.count(CurveEnd::closed) == 100);
    // The tolerance of f divided by its gradient, which is smallest near the axis.
    CHECK(result.gapMax < 5e-9);
    CHECK(result.driftMax[0] <= 1e-9);
    CHECK(c.edges() == c.vertices());
    for (size_t k = 0; k < c.size(); ++k) {
        const Vec3d seed{{seeds.x[k], seeds.y[k], seeds.z[k]}};
        const double r = radius(seed);
        CAPTURE(k, seed);
        REQUIRE(c.id[k] == seeds.id[k]);
        REQUIRE(c.upstream[k] == CurveEnd::closed);
        // Arcs of a circle are exact except for the truncated series, which leaves 0.03 t^8 of half an angle t < 1/8.
        REQUIRE(c.length[k] == Approx(2 * kPi * r).epsilon(1e-8));
        size_t at = c.start[k + 1];
        for (size_t v = c.start[k]; v < c.start[k + 1]; ++v) {
            REQUIRE(std::abs(radius(c.position(v)) - r) < 1e-8);
            REQUIRE(c.y[v] == Approx(seed[1]).margin(1e-8));
            if (v > c.start[k]) REQUIRE(c.along[v] > c.along[v - 1]);
            if (c.along[v] == 0) at = v;
        }
        REQUIRE(at < c.start[k + 1]);
        REQUIRE(c.position(at) == seed);
        // The seed is not repeated at the other end.
        REQUIRE(at == (direction == Direction::backward ? c.start[k + 1] - 1 : c.start[k]));
    }
}

TEST_CASE("trace: the curve length is fourth-order accurate in the step", "[track]") {
    // An ellipse with half axes 1 and 1/2, whose length is 4 E(3/4).
    const Flow flow(polynomial("x0**2 + 4*x1**2"), polynomial("x2"), {.box = cube(2), .wall = {}});
    const auto error = [&](double step) {
        const TraceResult result = trace(flow, seedsAt({{{1, 0, 0}}}), {.step = step, .turn = 1});
        REQUIRE(result.count(CurveEnd::closed) == 1);
        return std::abs(result.curves.length[0] - 4.844224110273838);
    };
    const double coarse = error(0.1), fine = error(0.05);
    CAPTURE(coarse, fine);
    CHECK(observedOrder(coarse, fine) > 3.7);
}

TEST_CASE("trace: end points match closed forms", "[track]") {
    // By time: a rotation by -2t and a hyperbola. RK4's error over 50 steps of 0.01 is below 1e-9.
    const auto file = reference("dfvn_exact_streamlines.json");
    size_t rows = 0;
    for (const auto& row : file.at("rows")) {
        const int n = row["n"].get<int>();
        if (n > 3) continue;
        ++rows;
        const auto coordinate = [&](const char* name, size_t axis) {
            return axis < row[name].size() ? row[name][axis].get<double>() : 0.0;
        };
        const auto point = [&](const char* name) {
            return Vec3d{{coordinate(name, 0), coordinate(name, 1), coordinate(name, 2)}};
        };
        const Flow flow(polynomial(row["f"][0].get<std::string>()),
                        n == 3 ? polynomial(row["f"][1].get<std::string>()) : polynomial("x2"),
                        {.box = cube(4), .wall = {}});
        const double time = row["t"].get<double>();
        const TraceResult result =
            trace(flow, seedsAt({point("x_start")}), {.by = StepBy::time, .step = 0.01, .limit = time, .closure = 0});
        const Curves& c = result.curves;
        CAPTURE(row["id"].get<int>());
        REQUIRE(c.downstream[0] == CurveEnd::limit);
        CHECK(c.along.back() == Approx(time).epsilon(1e-12));
        CHECK(length(c.position(c.vertices() - 1) - point("x_end")) < 1e-7);
    }
    CHECK(rows >= 3);
}

TEST_CASE("trace: the time along a vortex gives its angle", "[track]") {
    const double r = 0.6, omega = 2 * kPi / (1 + r * r / 0.25);
    const TraceResult result = trace(circles(), seedsAt({{{r, 0, 0}}}), {.by = StepBy::time, .step = 0.01});
    const Curves& c = result.curves;
    for (size_t v = 0; v < c.vertices(); ++v) {
        const Vec3d expected{{r * std::cos(omega * c.along[v]), 0, -r * std::sin(omega * c.along[v])}};
        CAPTURE(v, c.position(v), expected);
        REQUIRE(length(c.position(v) - expected) < 1e-7);
        REQUIRE(c.speed(v) == Approx(omega * r).epsilon(1e-6));
    }
}

TEST_CASE("trace: streamlines in a ball stay inside and on their tracks and most close", "[track]") {
    const Flow& flow = ballFlow();
    const Points seeds = scatter(flow.domain(), 200, 3);
    const TraceResult result = trace(flow, seeds, {.limit = 30});
    const Curves& c = result.curves;
    const size_t closed = result.count(CurveEnd::closed);
    CAPTURE(closed, result.count(CurveEnd::limit), result.count(CurveEnd::stuck), result.count(CurveEnd::stagnation),
            result.gapRms, result.gapMax, result.driftRms[0], result.driftRms[1], result.lengthMean);
    REQUIRE(c.size() == 200);
    size_t outside = 0;
    for (size_t v = 0; v < c.vertices(); ++v) outside += !(length(c.position(v)) < 1);
    CHECK(outside == 0);
    CHECK(closed > 150);
    CHECK(result.gapMax < 1e-6);
    CHECK(result.driftMax[0] <= 1e-8);
    CHECK(result.driftMax[1] <= 1e-8);
    CHECK(result.driftRms[0] > 0);
    for (size_t v = 0; v < c.vertices(); v += 97) {
        const auto sample = flow.at(c.position(v));
        // Subtracting and adding the residual again leaves a rounding error.
        CHECK(c.f[v] == Approx(sample.potentials[0]).margin(1e-15));
        CHECK(c.g[v] == Approx(sample.potentials[1]).margin(1e-15));
        CHECK(c.vx[v] == Approx(static_cast<float>(sample.velocity[0])).margin(1e-6));
        CHECK(c.speed(v) == Approx(length(sample.velocity)).epsilon(1e-6));
    }
    // Steps are shortened only at bends: no edge is longer than the step.
    const double step = length(flow.domain().box.size()) / 200;
    for (size_t k = 0; k < c.size(); ++k)
        for (size_t v = c.start[k] + 1; v < c.start[k + 1]; ++v) {
            REQUIRE(length(c.position(v) - c.position(v - 1)) < step * (1 + 1e-6));
            REQUIRE(c.along[v] - c.along[v - 1] <= step * (1 + 1e-12));
        }
    // A curve that closes in one direction also closes in the other.
    const TraceResult back = trace(flow, seeds, {.limit = 30, .direction = Direction::backward});
    size_t both = 0;
    for (size_t k = 0; k < c.size(); ++k) {
        if (!c.closed(k) || !back.curves.closed(k)) continue;
        ++both;
        CAPTURE(k);
        CHECK(back.curves.length[k] == Approx(c.length[k]).epsilon(1e-4));
    }
    CHECK(both > closed - 10);
}

TEST_CASE("trace: potentials do not drift over 2000 steps", "[track]") {
    const Flow& flow = ballFlow();
    const Points seeds = scatter(flow.domain(), 20, 8);
    TraceOptions options{.step = 0.02, .limit = 40, .closure = 0};
    const TraceResult result = trace(flow, seeds, options);
    CHECK(result.count(CurveEnd::limit) >= 19);
    CHECK(result.driftMax[0] <= 1e-9);
    CHECK(result.driftMax[1] <= 1e-9);
    // The integrator alone drifts off the track.
    options.reprojection.method = Reprojection::none;
    CHECK(trace(flow, seeds, options).driftRms[0] > 1e-7);
}

TEST_CASE("trace: no curve passes a wall thinner than its steps", "[track]") {
    const Side side = GENERATE(Side::both, Side::outside);
    const double half = 0.01;
    const Wall wall{.sdf = boxSdf({{40, 2 * half, 40}}, 0.004), .side = side, .width = 0.1};
    const Flow flow = withSpeed(Flow(noiseField<Psrd3>({.seed = 3}), bounded(noiseField<Psrd3>({.seed = 4}), wall),
                                     {.box = {{{-1, -0.3, -1}}, {{1, 0.3, 1}}}, .wall = wall}),
                                1);
    std::vector<Vec3d> points;
    for (const Vec3d& p : randomPoints(flow.domain().box, 300, 5))
        if (std::abs(std::abs(p[1]) - half) > 1e-4 && (side == Side::both || std::abs(p[1]) > half))
            points.push_back(p);
    const auto region = [&](const Vec3d& p) { return std::abs(p[1]) < half ? 0 : p[1] < 0 ? -1 : 1; };
    for (const auto reprojection : {Reprojection::gaussNewton, Reprojection::none}) {
        const TraceResult result = trace(flow, seedsAt(points),
                                         {.step = 0.5,
                                          .limit = 5,
                                          .turn = 4,
                                          .closure = 0,
                                          .reprojection = {.method = reprojection, .tolerance = 1e-9}});
        const Curves& c = result.curves;
        size_t jumps = 0;
        for (size_t k = 0; k < c.size(); ++k)
            for (size_t v = c.start[k]; v < c.start[k + 1]; ++v) jumps += region(c.position(v)) != region(points[k]);
        CAPTURE(static_cast<int>(side), static_cast<int>(reprojection), c.vertices());
        CHECK(c.vertices() > 2 * c.size());
        CHECK(jumps == 0);
    }
}

TEST_CASE("trace: a curve ends at a stagnation point", "[track]") {
    // c = (x, -y, 0): the curve runs down the y axis towards the origin.
    const Flow flow(polynomial("x0*x1"), polynomial("x2"), {.box = cube(1), .wall = {}});
    const TraceResult result = trace(flow, seedsAt({{{0, 1, 0.5}}, {{0, 0, 0.2}}}), {.step = 0.01, .stagnation = 0.05});
    const Curves& c = result.curves;
    CHECK(c.downstream[0] == CurveEnd::stagnation);
    CHECK(c.upstream[0] == CurveEnd::seed);
    const Vec3d end = c.position(c.start[1] - 1);
    CHECK(end[1] > 0.02); // the speed there is y, and its rms in the box is about 0.8
    CHECK(end[1] < 0.05);
    CHECK(end[0] == Approx(0).margin(1e-12));
    CHECK(c.length[0] == Approx(1 - end[1]).epsilon(1e-9));
    // A seed at the stagnation point.
    CHECK(c.downstream[1] == CurveEnd::stagnation);
    CHECK(c.start[2] - c.start[1] == 1);
    CHECK(c.length[1] == 0);
}

TEST_CASE("trace: a curve follows the sharp turn around a saddle", "[track]") {
    // The curve passes the origin at a distance of 0.014 with steps of 0.1, where it has to turn by a right angle.
    const Flow flow(polynomial("x0*x1"), polynomial("x2"), {.box = cube(1), .wall = {}});
    for (const double turn : {0.25, 4.0}) {
        const Curves c = trace(flow, seedsAt({{{1e-4, 1, 0.5}}}), {.step = 0.1, .turn = turn}).curves;
        CAPTURE(turn, c.vertices());
        REQUIRE(c.downstream[0] == CurveEnd::box);
        CHECK(c.position(c.vertices() - 1)[0] == 1);
        CHECK(c.position(c.vertices() - 1)[1] == Approx(1e-4).epsilon(1e-4));
        for (size_t v = 1; v < c.vertices(); ++v)
            CHECK(length(c.position(v) - c.position(v - 1)) > 0.5 * (c.along[v] - c.along[v - 1]));
        if (turn < 1) CHECK(c.length[0] == Approx(1.98).margin(0.01));
    }
}

TEST_CASE("trace: corrections never hold a curve in place", "[track]") {
    // The curve begins near a stagnation point, where a correction can revert a whole step.
    const Wall wall{.sdf = sphereSdf(1), .side = Side::inside, .width = 0.1};
    const Flow flow = withSpeed(Flow(noiseField<Psrd3>({}, {.frequency = 2}),
                                     bounded(noiseField<Psrd3>({.seed = 1}, {.frequency = 2}), wall), Domain::of(wall)),
                                1);
    const TraceResult result =
        trace(flow, seedsAt({{{0.48034956730586131, -0.22854051508266926, -0.048040739898321694}}}), {.limit = 40});
    CHECK(result.count(CurveEnd::closed) == 1);
    CHECK(result.lengthMax == Approx(24.053).epsilon(1e-3));
}

TEST_CASE("trace: a curve ends on the box or at the length limit or at the vertex limit", "[track]") {
    const Flow flow = uniformFlow({{2, 1, 0}}, {.box = cube(1), .wall = {}});
    const Points seeds = seedsAt({{{0.3, 0.2, 0.1}}});
    const Curves out = trace(flow, seeds, {.step = 0.04}).curves;
    CHECK(out.downstream[0] == CurveEnd::box);
    CHECK(out.x.back() == 1);
    CHECK(out.y.back() == Approx(0.55).epsilon(1e-12));
    CHECK(out.z.back() == Approx(0.1).epsilon(1e-12));
    CHECK(out.length[0] == Approx(0.7 * std::sqrt(1.25)).epsilon(1e-12));
    CHECK(out.vertices() == 21); // 0.7826 is 19.6 steps long

    const Curves both = trace(flow, seeds, {.step = 0.04, .limit = 0.5, .direction = Direction::both}).curves;
    CHECK(both.upstream[0] == CurveEnd::limit);
    CHECK(both.downstream[0] == CurveEnd::limit);
    CHECK(both.along.front() == Approx(-0.5).epsilon(1e-12));
    CHECK(both.along.back() == Approx(0.5).epsilon(1e-12));
    CHECK(both.length[0] == Approx(1).epsilon(1e-12));
    CHECK(both.vertices() == 27);
    CHECK(std::is_sorted(both.x.begin(), both.x.end()));

    const Curves few = trace(flow, seeds, {.step = 0.04, .vertices = 7, .direction = Direction::backward}).curves;
    CHECK(few.upstream[0] == CurveEnd::vertices);
    CHECK(few.downstream[0] == CurveEnd::seed);
    CHECK(few.vertices() == 7);
    CHECK(few.position(6) == Vec3d{{0.3, 0.2, 0.1}});

    // A seed on a face of the box, through which the flow leaves.
    const Curves edge = trace(flow, seedsAt({{{1, 0, 0}}}), {.step = 0.04}).curves;
    CHECK(edge.downstream[0] == CurveEnd::box);
    CHECK(edge.vertices() == 1);
}

TEST_CASE("trace: a curve that passes near its seed is not closed", "[track]") {
    // A helix whose pitch is a fifth of the step.
    const Flow helix = circles() + uniformFlow({{0, 0.01, 0}});
    const TraceOptions options{
        .step = 0.05, .limit = 20, .reprojection = {.method = Reprojection::none, .tolerance = 1e-9}};
    const TraceResult open = trace(helix, seedsAt({{{0.5, 0, 0}}}), options);
    CHECK(open.count(CurveEnd::limit) == 1);
    CHECK_FALSE(open.curves.hasTrack());
    // A sum of the same circles has no tracks. Its curves close as accurately as RK4 allows.
    const TraceResult closed = trace(circles() + circles(), seedsAt({{{0.5, 0, 0}}}), options);
    CHECK(closed.count(CurveEnd::closed) == 1);
    CHECK(closed.gapMax > 1e-12);
}

TEST_CASE("trace: seeds outside the domain give empty curves", "[track]") {
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
    for (const bool wall : {true, false}) {
        const Flow flow = wall ? ballFlow() : circles();
        const TraceResult result =
            trace(flow, seedsAt({{{nan, 0, 0}}, {{0.1, 0.2, 0.3}}, {{5, 0, 0}}, {{0, infinity, 0}}}),
                  {.limit = 1, .direction = Direction::both});
        const Curves& c = result.curves;
        CAPTURE(wall);
        REQUIRE(c.size() == 4);
        CHECK(result.count(CurveEnd::outside) == 3);
        for (const size_t k : {0, 2, 3}) {
            CHECK(c.start[k + 1] == c.start[k]);
            CHECK(c.upstream[k] == CurveEnd::outside);
        }
        CHECK(c.start[2] - c.start[1] > 10);
        CHECK(std::all_of(c.x.begin(), c.x.end(), [](double x) { return std::isfinite(x); }));
    }
    const TraceResult none = trace(ballFlow(), {});
    CHECK(none.curves.size() == 0);
    CHECK(none.curves.start == std::vector<size_t>{0});
    CHECK(none.lengthMean == 0);
    CHECK(none.gapRms == 0);
}

TEST_CASE("trace: does not depend on threads or order or other seeds", "[track]") {
    const Flow& flow = ballFlow();
    const Points seeds = scatter(flow.domain(), 100, 4);
    const TraceOptions options{.limit = 3, .direction = Direction::both};
    TraceResult one, two;
    {
        const ThreadLimit limit(1);
        one = trace(flow, seeds, options);
    }
    {
        const ThreadLimit limit(2);
        two = trace(flow, seeds, options);
    }
    CHECK(same(one.curves, two.curves));
    CHECK(one.driftRms == two.driftRms);
    CHECK(one.retries == two.retries);
    for (const size_t k : {0, 31, 32, 77, 99}) {
        const Curves alone = trace(flow, seedsAt({{{seeds.x[k], seeds.y[k], seeds.z[k]}}}), options).curves;
        const auto first = one.curves.x.begin() + static_cast<ptrdiff_t>(one.curves.start[k]);
        CAPTURE(k);
        REQUIRE(alone.vertices() == one.curves.start[k + 1] - one.curves.start[k]);
        CHECK(std::equal(alone.x.begin(), alone.x.end(), first));
        CHECK(alone.length[0] == one.curves.length[k]);
    }
}

TEST_CASE("trace: unsuitable flows and options are refused", "[track]") {
    const Points seeds = seedsAt({{{0.1, 0, 0}}});
    const Flow flow = circles();
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS_AS(trace(flow, seeds, {.step = -1}), ValueError);
    CHECK_THROWS_AS(trace(flow, seeds, {.step = nan}), ValueError);
    CHECK_THROWS_AS(trace(flow, seeds, {.limit = -1}), ValueError);
    CHECK_THROWS_AS(trace(flow, seeds, {.vertices = 1}), ValueError);
    CHECK_THROWS_AS(trace(flow, seeds, {.turn = 0}), ValueError);
    CHECK_THROWS_AS(trace(flow, seeds, {.stagnation = nan}), ValueError);
    CHECK_THROWS_AS(trace(flow, seeds, {.closure = 0.5}), ValueError);
    CHECK_THROWS_AS(trace(flow, seeds, {.reprojection = {.tolerance = 0}}), ValueError);
    CHECK_THROWS_AS(trace(flow, seeds, {.reprojection = {.tolerance = 1e-9, .iterations = 0}}), ValueError);
    CHECK_THROWS_AS(trace(flow, seeds, {.reprojection = {.tolerance = 1e-9, .maxSubdivisions = 21}}), ValueError);
    CHECK_THROWS_AS(trace(flow + flow, seeds), ValueError);
    CHECK_THROWS_AS(trace(vortexFlow(1, 1, {.box = cube(std::numeric_limits<double>::infinity()), .wall = {}}), seeds),
                    ValueError);
    Points ragged = seeds;
    ragged.y.clear();
    CHECK_THROWS_AS(trace(flow, ragged), ValueError);
    CHECK_THROWS_AS(trace(flow, seeds, {}, {{}, [] { return true; }}), Interrupted);
}
