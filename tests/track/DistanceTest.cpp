// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/track/Distance.h"
#include "support/Catch.h"

#include <cmath>
#include <initializer_list>
#include <numbers>

using namespace curlew;

namespace {

Points pointsAt(std::initializer_list<Vec3d> positions, std::vector<int64_t> ids) {
    Points p;
    for (const Vec3d& x : positions) p.x.push_back(x[0]), p.y.push_back(x[1]), p.z.push_back(x[2]);
    p.id = std::move(ids);
    return p;
}

/// A circle about the z axis with the given number of vertices. The first vertex is at the angle `turned`.
Curves circle(double radius, size_t vertices, double turned, bool closed) {
    Curves c;
    for (size_t k = 0; k < vertices; ++k) {
        const double angle = turned + 2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(vertices);
        c.x.push_back(radius * std::cos(angle)), c.y.push_back(radius * std::sin(angle)), c.z.push_back(0);
    }
    c.start.push_back(vertices);
    c.id = {5};
    c.upstream = c.downstream = {closed ? CurveEnd::closed : CurveEnd::limit};
    return c;
}

} // namespace

TEST_CASE("distanceBetween: points are matched by id", "[track]") {
    const Points a = pointsAt({{{0, 0, 0}}, {{1, 0, 0}}, {{5, 5, 5}}}, {3, 1, 9});
    const Points b = pointsAt({{{1, 0, 3}}, {{7, 7, 7}}, {{0, 4, 0}}}, {1, 2, 3});
    const Distance d = distanceBetween(a, b);
    CHECK(d.pairs == 2);
    CHECK(d.mean == 3.5);
    CHECK(d.rms == Approx(std::sqrt(12.5)));
    CHECK(d.max == 4);
    CHECK(d.unmatched == 2);
    CHECK_THROWS_AS(distanceBetween(a, pointsAt({{{0, 0, 0}}}, {2})), ValueError);
    CHECK_THROWS_AS(distanceBetween(a, pointsAt({{{0, 0, 0}}, {{0, 0, 1}}}, {3, 3})), ValueError);
}

TEST_CASE("distanceBetween: curves are compared independently of their vertices", "[track]") {
    const Curves inner = circle(1, 2000, 0, true);
    const Distance apart = distanceBetween(inner, circle(1.1, 3000, 0.3, true));
    CHECK(apart.pairs == 2000);
    CHECK(apart.mean == Approx(0.1).epsilon(1e-4));
    CHECK(apart.max == Approx(0.1).epsilon(1e-4));
    CHECK(distanceBetween(inner, circle(1, 999, 0.7, true)).max < 1e-5);
    // Without its closing edge, the square does not pass near that part.
    const Curves middle = circle(0.5, 4, -std::numbers::pi / 4, true);
    CHECK(distanceBetween(middle, circle(1, 4, 0, true)).max < distanceBetween(middle, circle(1, 4, 0, false)).max);
    Curves none = circle(1, 10, 0, false);
    none.start = {0, 0};
    CHECK_THROWS_AS(distanceBetween(inner, none), ValueError);
}
