// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/track/VolumeChange.h"
#include "support/Formula.h"
#include "support/MovingPoints.h"
#include "support/Points.h"
#include "support/Polynomial.h"

using namespace curlew;
using namespace curlew::test;

TEST_CASE("volumeChange: is 1 for a divergence-free flow and differs for a normalised one", "[track]") {
    const Flow flow(sinesF(), sinesG(), {.box = cube(3), .wall = {}});
    const auto points = randomPoints(cube(1), 200, 3);
    const AdvectOptions options{.time = 0.3};
    const VolumeChange kept = volumeChange(flow, points, 0, options);
    CHECK(kept.samples == 200);
    CHECK(kept.farthest < 1e-6); // about 100 steps with errors of 1e-9
    CHECK(std::abs(kept.median - 1) <= kept.farthest);
    const VolumeChange changed = volumeChange(flow.normalized(1), points, 0, options);
    CHECK(changed.lower < 0.9);
    CHECK(changed.upper > 1.1);
}

TEST_CASE("volumeChange: matches known factors", "[track]") {
    // If normalised, x' = n/|n| for n = (2y, -2x, 0) rotates at speed 1, at radius r by the angle t / r. This preserves
    // areas.
    const Flow turning =
        Flow(polynomial("x0**2 + x1**2"), polynomial("x2"), {.box = cube(2), .wall = {}}).normalized(1);
    CHECK(volumeChange(turning, {{{1, 0, 0}}, {{0.5, 0.5, 0.3}}}, 0, {.time = 2}).farthest < 1e-7);
    // f = y / x is a function of the angle: if normalised, x' = ±x/r. A point moves from radius r to r + t, so areas
    // grow by the factor (r + t) / r.
    const Flow radial = Flow(formula([](const auto& x) { return x[1] * reciprocal(x[0]); }), polynomial("x2"),
                             {.box = BoxN<3>{{{0.5, -0.2, -1}}, {{3, 0.2, 1}}}, .wall = {}})
                            .normalized(1);
    const Vec3d from{{1, 0.1, 0}};
    const double r = length(from), sign = radial.at(from).velocity[0] > 0 ? 1 : -1;
    const VolumeChange spread = volumeChange(radial, {from}, 0, {.time = sign * 0.5});
    CHECK(spread.median == Approx((r + 0.5) / r).epsilon(1e-7));
}

TEST_CASE("volumeChange: is 1 for a bounded noise with kinks in its Hessian", "[track]") {
    const Flow flow = boundFlow(sphereSdf(1), Side::inside);
    std::vector<Vec3d> points = randomPoints(cube(0.5), 20, 4);
    points.push_back({{3, 0, 0}}); // beyond the wall
    const VolumeChange kept = volumeChange(flow, points, 0, {.time = 2});
    CHECK(kept.samples == 20);
    CHECK(kept.farthest < 1e-6);
}

TEST_CASE("volumeChange: no points give no samples, zero time gives 1 and invalid times are errors", "[track]") {
    const Flow flow(sinesF(), sinesG(), {.box = cube(3), .wall = {}});
    CHECK(volumeChange(flow, {}, 0, {}).samples == 0);
    CHECK(volumeChange(flow, {Vec3d{}}, 0, {.time = 0}).median == 1);
    CHECK_THROWS_AS(volumeChange(flow, {Vec3d{}}, std::nan(""), {}), ValueError);
    CHECK_THROWS_AS(volumeChange(flow, {Vec3d{}}, 0, {.time = std::nan("")}), ValueError);
}
