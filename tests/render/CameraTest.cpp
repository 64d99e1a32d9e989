// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/render/Camera.h"
#include "support/Catch.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

using namespace curlew;

namespace {

const Vec3d kUp{{0, 1, 0}};

} // namespace

TEST_CASE("Camera: projects the target to the centre with right to the right and up to the top", "[render]") {
    const Camera camera({{0, 0, 5}}, {{0, 0, 0}}, kUp, 40, 320, 200);
    const auto middle = camera.project({});
    CHECK(middle.x == Approx(160));
    CHECK(middle.y == Approx(100));
    CHECK(middle.depth == Approx(5));
    CHECK(camera.project({{1, 0, 0}}).x > 160);
    CHECK(camera.project({{0, 1, 0}}).y < 100);
    CHECK(camera.project({{0, 0, 6}}).depth < 0);
    // The longer edge spans the field of view.
    const double halfWidth = 5 * std::tan(20 * std::numbers::pi / 180);
    CHECK(camera.project({{halfWidth, 0, 0}}).x == Approx(320));
    CHECK(middle.pixelsPerUnit == Approx(160 / halfWidth));
}

TEST_CASE("Camera: direction and project are inverse", "[render]") {
    const Camera camera({{3, 2, -1}}, {{0.2, 0.1, 0.5}}, {{0.1, 1, 0.3}}, 55, 200, 300);
    for (const double x : {0.5, 71.25, 199.0})
        for (const double y : {1.5, 150.0, 299.5}) {
            const Vec3d direction = camera.direction(x, y);
            CHECK(length(direction) == Approx(1));
            const auto back = camera.project(camera.eye() + direction * 7.5);
            CHECK(back.x == Approx(x));
            CHECK(back.y == Approx(y));
            CHECK(back.depth == Approx(7.5 * dot(direction, camera.forward())));
        }
    CHECK(cross(camera.right(), camera.up())[2] == Approx(-camera.forward()[2]));
}

TEST_CASE("Camera: around a box shows all of it with the given margin", "[render]") {
    const Box box{{{-1, 0, -3}}, {{2, 1, 0.5}}};
    for (const Vec3d& from : {Vec3d{{0, 0, 1}}, Vec3d{{0.6, 0.45, 1}}, Vec3d{{-2, 0.5, 0.1}}}) {
        constexpr double kMargin = 0.04;
        const Camera camera =
            Camera::around(box, {.from = from, .up = kUp, .width = 400, .height = 300, .margin = kMargin});
        double nearest = 1;
        for (int corner = 0; corner < 8; ++corner) {
            Vec3d p;
            for (int axis = 0; axis < 3; ++axis) p[axis] = ((corner >> axis) & 1 ? box.upper : box.lower)[axis];
            const auto seen = camera.project(p);
            REQUIRE(seen.depth > 0);
            const double toEdge = std::min({seen.x / 400, 1 - seen.x / 400, seen.y / 300, 1 - seen.y / 300});
            CHECK(toEdge >= kMargin * (1 - 1e-9));
            nearest = std::min(nearest, toEdge);
        }
        CHECK(nearest == Approx(kMargin));
    }
}

TEST_CASE("Camera: invalid parameters are refused", "[render]") {
    CHECK_THROWS_AS(Camera({}, {}, kUp, 40, 10, 10), ValueError);
    CHECK_THROWS_AS(Camera({{0, 1, 0}}, {}, kUp, 40, 10, 10), ValueError);
    CHECK_THROWS_AS(Camera({{0, 0, 1}}, {}, kUp, 0, 10, 10), ValueError);
    CHECK_THROWS_AS(Camera({{0, 0, 1}}, {}, kUp, 175, 10, 10), ValueError);
    CHECK_THROWS_AS(Camera({{0, 0, 1}}, {}, kUp, 40, 0, 10), ValueError);
    CHECK_THROWS_AS(Camera({{0, 0, std::numeric_limits<double>::quiet_NaN()}}, {}, kUp, 40, 10, 10), ValueError);
    CHECK_THROWS_AS(Camera::around(Box{{{0, 0, 0}}, {{0, 0, 0}}}, {.from = {{0, 0, 1}}}), ValueError);
    const double infinity = std::numeric_limits<double>::infinity();
    CHECK_THROWS_AS(Camera::around(Box{{{0, 0, 0}}, {{1, 1, infinity}}}, {.from = {{0, 0, 1}}}), ValueError);
    CHECK_THROWS_AS(Camera::around(Box{{{0, 0, 0}}, {{1, 1, 1}}}, {.from = {}}), ValueError);
}
