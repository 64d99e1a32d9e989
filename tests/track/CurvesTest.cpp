// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/track/Curves.h"
#include "support/Catch.h"

using namespace curlew;

TEST_CASE("curvesOf: a polyline without points becomes a curve without vertices", "[track]") {
    const std::vector<Vec3d> square{{{0, 0, 0}}, {{1, 0, 0}}, {{1, 1, 0}}, {{0, 1, 0}}};
    const Curves curves = curvesOf({{.closed = true, .id = 3}, {.points = square, .closed = true, .id = 4}, {}});
    CHECK(curves.id == std::vector<int64_t>{3, 4, 0});
    CHECK(curves.start == std::vector<size_t>{0, 0, 4, 4});
    CHECK(curves.length == std::vector<double>{0, 4, 0});
    CHECK(curves.edges() == 4);
}

TEST_CASE("curvesOf: edges are joined, and the ids must be as many as the vertices", "[track]") {
    const std::vector<Vec3d> vertices{{{0, 0, 0}}, {{1, 0, 0}}, {{2, 0, 0}}};
    const std::vector<CurveEdge> edges{{0, 1}, {2, 1}};
    CHECK(curvesOf(vertices, edges).id == std::vector<int64_t>{0});
    CHECK(curvesOf(vertices, edges, {7, 8, 9}).id == std::vector<int64_t>{7});
    CHECK(curvesOf(vertices, edges, {7, 8, 9}).length == std::vector<double>{2});
    CHECK_THROWS_WITH(curvesOf(vertices, edges, {7, 8}), Catch::ContainsSubstring("2 ids"));
    CHECK_THROWS_AS(curvesOf(vertices, edges, {7, 8, 9, 10}), ValueError);
}
