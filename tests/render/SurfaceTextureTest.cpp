// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/flow/Flows.h"
#include "curlew/picture/ColorMap.h"
#include "curlew/render/SurfaceTexture.h"
#include "support/Points.h"

#include <limits>
#include <numbers>

using namespace curlew;

namespace {

const Vec3f kEven{{1, 0, 0}}, kOdd{{0, 0, 1}};

/// A ball from the front; its flow turns about the y axis: f = y, g = the distance.
const Camera kCamera({{0, 0, 4}}, {}, {{0, 1, 0}}, 35, 64, 48);
Flow turning() { return Flow(rampField(Vec3d{{0, 1, 0}}), sphereSdf(1).distance); }

double correlation(const std::vector<float>& a, const std::vector<float>& b) {
    double ab = 0, aa = 0, bb = 0;
    for (size_t k = 0; k < a.size(); ++k) {
        const double x = static_cast<double>(a[k]) - 0.5, y = static_cast<double>(b[k]) - 0.5;
        ab += x * y;
        aa += x * x;
        bb += y * y;
    }
    return ab / std::sqrt(aa * bb);
}

} // namespace

TEST_CASE("checkerAt: cells alternate along every axis", "[render]") {
    for (uint64_t k = 0; k < 100; ++k) {
        const Vec3d p = test::randomPoint(test::cube(3), 5, k);
        for (int axis = 0; axis < 3; ++axis) {
            Vec3d next = p;
            next[axis] += 0.25;
            CHECK(checkerAt(p, 0.25, kEven, kOdd) != checkerAt(next, 0.25, kEven, kOdd));
            next[axis] += 0.25;
            CHECK(checkerAt(p, 0.25, kEven, kOdd) == checkerAt(next, 0.25, kEven, kOdd));
        }
    }
    CHECK(checkerAt({{0.1, 0.1, 0.1}}, 0.25, kEven, kOdd) == kEven);
}

TEST_CASE("latitudeAt and wavesAt: go around the y axis without a seam", "[render]") {
    const Vec3d center{{1, 2, 3}};
    for (const double y : {-2.0, -0.9, -0.3, 0.0, 0.4, 0.99}) {
        const Vec3f color = latitudeAt(center + Vec3d{{1, y, 0}}, center);
        CHECK(latitudeAt(center + Vec3d{{0, 2 * y, -2}}, center) == color);
        for (const float part : color.c) CHECK((part > 0 && part < 1));
    }
    CHECK(latitudeAt(center, center) == latitudeAt(center + Vec3d{{1, 0, 0}}, center));
    for (double height = -1; height < 1; height += 0.173) {
        CHECK(wavesAt({{-1, height, 1e-9}}, 0.1) == wavesAt({{-1, height, -1e-9}}, 0.1));
        const double turn = 2 * std::numbers::pi / 12;
        CHECK(wavesAt({{std::cos(0.3), height, std::sin(0.3)}}, 0.1) ==
              wavesAt({{std::cos(0.3 + turn), height, std::sin(0.3 + turn)}}, 0.1));
    }
}

TEST_CASE("surfaceLic: streaks correlate along streamlines and not across", "[render]") {
    const SurfaceView view = viewSurface(Surface(sphereSdf(1)), kCamera, 1);
    const SurfaceLicOptions options{.length = 30};
    const std::vector<float> here = surfaceLic(view, turning(), options);
    REQUIRE(here.size() == view.hits.size());
    // The noise is fixed in space, so moving the surface by two pixels reveals its correlation.
    const auto moved = [&](const Vec3d& by) {
        SurfaceView other = view;
        for (SurfaceSample& hit : other.hits) {
            hit.position += by * (8 * view.resolution); // of a quarter of a pixel each
            hit.position *= 1 / length(hit.position);
        }
        return surfaceLic(other, turning(), options);
    };
    // A Hann window of 30 pixels hardly changes over two, but the cubes of noise that a streamline meets do; across it
    // noise of 1.6 pixels does not last over two.
    CHECK(correlation(here, moved({{1, 0, 0}})) > 0.5);
    CHECK(std::abs(correlation(here, moved({{0, 1, 0}}))) < 0.3);
    double squares = 0;
    for (const float v : here) {
        REQUIRE((v >= 0 && v <= 1));
        squares += (static_cast<double>(v) - 0.5) * (static_cast<double>(v) - 0.5);
    }
    CHECK(std::sqrt(squares / static_cast<double>(here.size())) == Approx(options.contrast).epsilon(0.05));
    CHECK_THROWS_AS(surfaceLic(view, turning(), {.length = 0}), ValueError);
    CHECK_THROWS_AS(surfaceLic(view, turning(), {.grain = -1}), ValueError);
}

TEST_CASE("viewThrough: shows the far side of a surface", "[render]") {
    const Surface ball(sphereSdf(1));
    const SurfaceView view = viewSurface(ball, kCamera, 2), through = viewThrough(ball, view);
    REQUIRE(through.first.size() == view.first.size());
    // Every ray but the most grazing ones leaves again.
    CHECK(static_cast<double>(through.hits.size()) > 0.97 * static_cast<double>(view.hits.size()));
    const size_t middle = 24 * 64 + 32;
    CHECK(static_cast<double>(through.hits[through.first[middle]].depth) == Approx(5).epsilon(1e-3));
    for (const SurfaceSample& hit : through.hits) REQUIRE(length(hit.position) == Approx(1).epsilon(1e-9));
}

TEST_CASE("wavesAt: a coordinate that is not finite has no colour", "[render]") {
    const double infinity = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
    for (const double bad : {nan, infinity, -infinity})
        for (int axis = 0; axis < 3; ++axis) {
            Vec3d p{{0.1, 0.2, 0.3}};
            p[axis] = bad;
            CHECK(wavesAt(p, 0.1) == kNoValueColor);
        }
}
