// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/render/SurfaceView.h"
#include "support/Points.h"

#include <numbers>

using namespace curlew;

namespace {

const Camera kCamera({{0, 0, 4}}, {}, {{0, 1, 0}}, 35, 160, 120);

} // namespace

TEST_CASE("viewSurface: coverage of a ball equals its projected area", "[render]") {
    const SurfaceView view = viewSurface(Surface(sphereSdf(0.8)), kCamera, 3);
    // The cone touches at sin = r / d; its circle is f tan across the axis, f pixels.
    const double focal = 80 / std::tan(17.5 * std::numbers::pi / 180);
    const double radius = focal * std::tan(std::asin(0.8 / 4));
    // Of as many samples on a lattice, an area is off by a part of its edge.
    CHECK(view.coverage() == Approx(std::numbers::pi * radius * radius / (160 * 120)).epsilon(2e-3));
    REQUIRE(view.first.size() == 160 * 120 + 1);
    CHECK(view.first.back() == view.hits.size());
    const SurfaceSample& middle = view.hits[view.first[60 * 160 + 80]];
    CHECK(middle.depth == Approx(3.2).epsilon(1e-4));
    CHECK(middle.normal[2] == Approx(1).epsilon(1e-4));
    for (size_t k = 0; k < view.hits.size(); k += 97)
        CHECK(length(view.hits[k].position) == Approx(0.8).epsilon(1e-10));
}

TEST_CASE("viewSurface: hits project into their pixels", "[render]") {
    const SurfaceView view = viewSurface(Surface(torusSdf(0.8, 0.3)), kCamera, 2);
    for (size_t pixel = 0; pixel + 1 < view.first.size(); ++pixel)
        for (size_t k = view.first[pixel]; k < view.first[pixel + 1]; ++k) {
            const auto seen = kCamera.project(view.hits[k].position);
            REQUIRE(static_cast<size_t>(seen.y) * 160 + static_cast<size_t>(seen.x) == pixel);
        }
}

TEST_CASE("viewSurface: does not depend on the number of threads", "[render]") {
    const Surface surface(torusSdf(0.8, 0.3));
    const auto withThreads = [&](int threads) {
        const ThreadLimit limit(threads);
        return viewSurface(surface, kCamera, 2);
    };
    const SurfaceView one = withThreads(1), four = withThreads(4);
    REQUIRE(one.first == four.first);
    for (size_t k = 0; k < one.hits.size(); ++k) REQUIRE(one.hits[k].position == four.hits[k].position);
}

TEST_CASE("framing: a fitted surface fills the picture", "[render]") {
    const Surface surface(torusSdf(0.7, 0.3));
    const Camera camera = framing(surface, {.width = 320, .height = 240});
    const SurfaceView view = viewSurface(surface, camera, 1);
    double left = 320, right = 0;
    for (const SurfaceSample& hit : view.hits) {
        const auto seen = camera.project(hit.position);
        left = std::min(left, seen.x);
        right = std::max(right, seen.x);
    }
    // The coarse grid of rays is 2.5 pixels wide.
    CHECK(left == Approx(kFramingMargin * 320).margin(4));
    CHECK(right == Approx((1 - kFramingMargin) * 320).margin(4));
}

TEST_CASE("viewSurface: invalid sample counts are refused and cancellation works", "[render]") {
    for (const int samples : {0, -1, 17})
        CHECK_THROWS_AS(viewSurface(Surface(sphereSdf(1)), kCamera, samples), ValueError);
    const Camera away({{0, 0, 4}}, {{0, 0, 8}}, {{0, 1, 0}}, 35, 16, 12);
    CHECK(viewSurface(Surface(sphereSdf(1)), away).hits.empty());
    CHECK_THROWS_AS(viewSurface(Surface(sphereSdf(1)), kCamera, 3, {.report = {}, .cancelled = [] { return true; }}),
                    Interrupted);
}
