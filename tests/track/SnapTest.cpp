// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/Shapes.h"
#include "curlew/track/Scatter.h"
#include "curlew/track/Snap.h"
#include "support/Catch.h"
#include "support/MovingPoints.h"
#include "support/Polynomial.h"

using namespace curlew;
using namespace curlew::test;

TEST_CASE("snap: moves points to the nearest point of a distance field", "[track]") {
    Points points = scatter({.box = Box{}.padded(1.5), .wall = {}}, 3000, 1);
    points.f = points.g = std::vector<double>(3000, 1.0);
    const Points start = points;
    const SnapResult result = snap(sphereSdf(1).distance, 0, points, 3);
    CHECK(result.points == 3000);
    CHECK(result.missed == 0);
    CHECK(result.moved > 0.1);
    CHECK(!points.hasTrack());
    for (size_t k = 0; k < 3000; ++k) {
        const Vec3d from = position(start, k), to = position(points, k);
        CAPTURE(k, from);
        REQUIRE(length(to) == Approx(1).epsilon(1e-9));
        REQUIRE(length(to - from * (1 / length(from))) < 1e-8);
    }
}

TEST_CASE("snap: reaches a value of a general field within its reach or leaves the point", "[track]") {
    const ScalarField field = sinesF();
    Points points = scatter({.box = Box{}.padded(1), .wall = {}}, 500, 2);
    const Points start = points;
    const SnapResult result = snap(field, 0.1, points, 0.2);
    CHECK(result.missed > 0);
    CHECK(result.missed < 500);
    size_t stayed = 0;
    for (size_t k = 0; k < 500; ++k) {
        const Vec3d from = position(start, k), to = position(points, k);
        if (std::abs(field.at<0>(to).value - 0.1) > 1e-9) {
            REQUIRE(from == to);
            ++stayed;
        }
        REQUIRE(length(to - from) <= 0.2);
    }
    CHECK(stayed == result.missed);
    CHECK_THROWS_AS(snap(field, HUGE_VAL, points), ValueError);
    CHECK_THROWS_AS(snap(field, 0, points, 0), ValueError);
    CHECK_THROWS_AS(snap(field, 0, points, 1, 0), ValueError);
}
