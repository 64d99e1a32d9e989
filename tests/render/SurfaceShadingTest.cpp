// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/render/SurfaceShading.h"
#include "support/Points.h"

using namespace curlew;

namespace {

const Camera kCamera({{0, 0, 6}}, {}, {{0, 1, 0}}, 35, 96, 72);
const std::vector<Vec3f> kRed{Vec3f{{0.8f, 0.1f, 0.1f}}}, kBlue{Vec3f{{0.1f, 0.1f, 0.8f}}};

Surface ball(double radius, const Vec3d& center) { return Surface(placed(sphereSdf(radius), {.offset = center})); }

Image picture(const Surface& surface, const std::vector<Vec3f>& colors, const SurfaceLook& look = {},
              const Image* behind = nullptr, const Surface* shadows = nullptr) {
    return shadeSurface(viewSurface(surface, kCamera, 3), colors, look, shadows, behind);
}

} // namespace

TEST_CASE("shadeSurface: gives colour and coverage and depth", "[render]") {
    const Image image = picture(ball(1, {}), kRed);
    CHECK(image.channels == std::vector<std::string>{"R", "G", "B", "A", "Z"});
    CHECK(image.at(48, 36, 0) > 3 * image.at(48, 36, 2));
    CHECK(image.at(48, 36, 3) == 1);
    CHECK(image.at(48, 36, 4) == Approx(5).epsilon(1e-3));
    CHECK(image.at(0, 0, 3) == 0);
    CHECK(std::isinf(image.at(0, 0, 4)));
    // The light comes from the upper left: it is brighter there than in the lower right.
    CHECK(image.at(44, 30, 0) > image.at(52, 42, 0));
    double edge = 0;
    for (int x = 0; x < 96; ++x) edge += image.at(x, 36, 3) > 0 && image.at(x, 36, 3) < 1 ? 1 : 0;
    CHECK(edge >= 1); // pixels that are covered in part
}

TEST_CASE("shadeSurface: the nearer surface hides the farther one in any drawing order", "[render]") {
    const Surface near = ball(0.7, {{0.3, 0, 1}}), far = ball(0.9, {{-0.3, 0.1, -1}});
    const Image nearFirst = picture(near, kRed), farFirst = picture(far, kBlue);
    const Image one = picture(far, kBlue, {}, &nearFirst), two = picture(near, kRed, {}, &farFirst);
    double worst = 0;
    for (int y = 0; y < 72; ++y)
        for (int x = 0; x < 96; ++x) {
            REQUIRE(one.at(x, y, 4) == two.at(x, y, 4));
            // Where both silhouettes share a pixel, the overlap of their coverage is unknown.
            if (one.at(x, y, 3) < 1) continue;
            for (int c = 0; c < 3; ++c) {
                const float off = one.at(x, y, c) - two.at(x, y, c);
                worst = std::max(worst, static_cast<double>(std::abs(off)));
            }
        }
    CHECK(worst < 1e-5);
}

TEST_CASE("shadeSurface: an outline adds light and hides nothing", "[render]") {
    const Image solid = picture(ball(0.6, {}), kRed);
    const Image rim = picture(ball(1, {}), kBlue, {.finish = Finish::outline}, &solid);
    for (int y = 0; y < 72; ++y)
        for (int x = 0; x < 96; ++x) {
            REQUIRE(rim.at(x, y, 4) == solid.at(x, y, 4));
            REQUIRE(rim.at(x, y, 3) == solid.at(x, y, 3));
            for (int c = 0; c < 3; ++c) REQUIRE(rim.at(x, y, c) >= solid.at(x, y, c) - 1e-6f);
        }
    // It is bright at its edge, and faint in its middle.
    const auto added = [&](int x) { return rim.at(x, 36, 2) - solid.at(x, 36, 2); };
    float brightest = 0;
    for (int x = 48; x < 96; ++x) brightest = std::max(brightest, added(x));
    CHECK(brightest > 4 * added(48));
}

TEST_CASE("shadeSurface: objects cast shadows", "[render]") {
    const Sdf two = unite(planeSdf({{0, 1, 0}}, -0.6), placed(sphereSdf(0.3), {.offset = {{0, 0.4, 0}}}), 0);
    const Surface surface(two, test::cube(1));
    const SurfaceLook look{.light = {{0, 1, 0}}};
    const Camera camera({{0, 3, 5}}, {}, {{0, 1, 0}}, 35, 96, 72);
    const SurfaceView view = viewSurface(surface, camera, 2);
    const Image lit = shadeSurface(view, kRed, look), dark = shadeSurface(view, kRed, look, &surface);
    const auto at = [&](const Image& image, const Vec3d& p) {
        const auto seen = camera.project(p);
        return image.at(static_cast<int>(seen.x), static_cast<int>(seen.y), 0);
    };
    const Vec3d below{{0, -0.6, 0.1}}, beside{{0.8, -0.6, 0.3}};
    CHECK(at(dark, below) < 0.7f * at(lit, below));
    CHECK(at(dark, beside) == at(lit, beside));
}

TEST_CASE("shadeSurface: mismatched colours or backgrounds are refused", "[render]") {
    const SurfaceView view = viewSurface(ball(1, {}), kCamera, 1);
    CHECK_THROWS_AS(shadeSurface(view, {}, {}), ValueError);
    CHECK_THROWS_AS(shadeSurface(view, std::vector<Vec3f>(7), {}), ValueError);
    const Image small = filledImage(8, 6, {"R", "G", "B", "A", "Z"}), flat = filledImage(96, 72, {"R", "G", "B"});
    CHECK_THROWS_AS(shadeSurface(view, kRed, {}, nullptr, &small), ValueError);
    CHECK_THROWS_AS(shadeSurface(view, kRed, {}, nullptr, &flat), ValueError);
}
