// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/picture/Display.h"
#include "curlew/render/WallOutline.h"
#include "support/Catch.h"

#include <algorithm>
#include <cmath>

using namespace curlew;

namespace {

const Domain kBall = Domain::of({.sdf = sphereSdf(1), .side = Side::inside, .width = 0.1});
const Camera kCamera({{0, 0, 6}}, {}, {{0, 1, 0}}, 30, 200, 160);

} // namespace

TEST_CASE("wallOutline: a ball gives a bright ring at its silhouette and faint inside", "[render]") {
    const Image outline = wallOutline(kBall, kCamera);
    REQUIRE(outline.width == 200);
    REQUIRE(outline.height == 160);
    // The edge is seen at the sine 1/6 from the middle.
    const double focal = kCamera.project({{0, 0, 5}}).pixelsPerUnit, edge = focal * std::tan(std::asin(1 / 6.0));
    for (int y = 0; y < 160; ++y)
        for (int x = 0; x < 200; ++x) {
            const double radius = std::hypot(x + 0.5 - 100, y + 0.5 - 80);
            CAPTURE(x, y, radius, edge);
            if (radius < 0.5 * edge) REQUIRE(outline.at(x, y) < 0.02f);
            if (std::abs(radius - edge) < 0.7) REQUIRE(outline.at(x, y) > 0.25f);
            if (radius > edge + 6) REQUIRE(outline.at(x, y) < 1e-3f);
            REQUIRE(outline.at(x, y) <= 1);
        }
}

TEST_CASE("wallOutline: an obstacle hides what is behind it, a container does not", "[render]") {
    const auto middle = [](Side side) { // where the edge of the ball behind would be seen
        const Sdf balls = unite(sphereSdf(1), placed(sphereSdf(0.4), Placement{.offset = {{0, 0, -1.5}}}), 0);
        const Image outline = wallOutline(Domain::of({.sdf = balls, .side = side, .width = 0.1}), kCamera);
        float most = 0;
        for (int x = 80; x < 120; ++x) most = std::max(most, outline.at(x, 80));
        return most;
    };
    CHECK(middle(Side::inside) > 0.1f);
    CHECK(middle(Side::outside) < 0.02f);
}

TEST_CASE("wallOutline: edges look like those of a larger picture that is made smaller", "[render]") {
    constexpr int kTimes = 4;
    const Domain ring = Domain::of({.sdf = torusSdf(0.9, 0.35), .side = Side::inside, .width = 0.1});
    const auto seen = [&](int times) {
        return wallOutline(ring, Camera({{0, 3, 6}}, {}, {{0, 1, 0}}, 30, times * 160, times * 120));
    };
    const Image one = seen(1), large = seen(kTimes);
    const auto meanOf = [&](int x, int y) {
        double sum = 0;
        for (int k = 0; k < kTimes * kTimes; ++k)
            sum += static_cast<double>(large.at(kTimes * x + k % kTimes, kTimes * y + k / kTimes));
        return sum / (kTimes * kTimes);
    };
    // Outside the silhouette, the light fades out within two pixels, which are larger in the small picture.
    const auto isInside = [&](int x, int y) {
        constexpr int kReach = 4;
        for (int j = y - kReach; j <= y + kReach; ++j)
            for (int i = x - kReach; i <= x + kReach; ++i)
                if (j < 0 || i < 0 || j >= one.height || i >= one.width || meanOf(i, j) < 0.01) return false;
        return true;
    };
    double worst = 0;
    size_t compared = 0;
    for (int y = 0; y < one.height; ++y)
        for (int x = 0; x < one.width; ++x)
            if (isInside(x, y)) {
                worst = std::max(worst, std::abs(static_cast<double>(one.at(x, y)) - meanOf(x, y)));
                ++compared;
            }
    CHECK(compared > 1000);
    CHECK(worst < 0.08);
}

TEST_CASE("wallOutline: does not depend on the number of threads", "[render]") {
    const auto draw = [](int threads) {
        const ThreadLimit limit(threads);
        return wallOutline(kBall, kCamera).pixels;
    };
    CHECK(draw(1) == draw(3));
}

TEST_CASE("wallOutline: requires a wall in a finite box", "[render]") {
    CHECK_THROWS_AS(wallOutline({}, kCamera), ValueError);
    Domain endless = kBall;
    endless.box = {{{-HUGE_VAL, -1, -1}}, {{1, 1, 1}}};
    CHECK_THROWS_AS(wallOutline(endless, kCamera), ValueError);
}

TEST_CASE("withWallOutline: brightens a picture only where the outline is", "[render]") {
    const Image ground = plainPicture(200, 160, {{0.1f, 0.1f, 0.1f}});
    const Image outline = wallOutline(kBall, kCamera), lit = withWallOutline(ground, kBall, kCamera, 0.5);
    const Image brighter = withWallOutline(ground, kBall, kCamera, 1);
    for (int y = 0; y < 160; ++y)
        for (int x = 0; x < 200; ++x)
            for (int i = 0; i < 3; ++i) {
                if (outline.at(x, y) == 0) REQUIRE(lit.at(x, y, i) == ground.at(x, y, i));
                if (outline.at(x, y) > 0.1f) REQUIRE(lit.at(x, y, i) > ground.at(x, y, i));
                REQUIRE(brighter.at(x, y, i) >= lit.at(x, y, i));
            }
    CHECK_THROWS_AS(withWallOutline(plainPicture(9, 9, {}), kBall, kCamera, 1), ValueError);
    CHECK_THROWS_AS(withWallOutline(ground, kBall, kCamera, 0), ValueError);
}
