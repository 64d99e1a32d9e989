// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/field/Shapes.h"
#include "curlew/flow/Flows.h"
#include "curlew/picture/Slice.h"
#include "support/Catch.h"

#include <algorithm>
#include <cmath>

using namespace curlew;

namespace {

const Box kBox{{{-1, -2, -3}}, {{1, 2, 3}}};

/// The field x + 10 y + 100 z.
ScalarField places() { return rampField(Vec3d{{1, 10, 100}}); }

/// A flow within a sphere.
Flow containedFlow() {
    const Wall wall{.sdf = sphereSdf(0.8), .side = Side::inside, .width = 0.2};
    const OctaveOptions octaves{.frequency = 2};
    return Flow(noiseField<Psrd3>({.seed = 1}, octaves), bounded(noiseField<Psrd3>({.seed = 2}, octaves), wall),
                Domain::of(wall));
}

} // namespace

TEST_CASE("slice: pixels show the positions of their plane", "[picture]") {
    struct Case {
        int axis, right, up;
    };
    const auto c = GENERATE(Case{0, 2, 1}, Case{1, 0, 2}, Case{2, 0, 1});
    const SliceOptions options{.axis = c.axis, .position = 0.5, .width = 40, .margin = 0};
    const PicturePlane plane(kBox, options);
    CAPTURE(c.axis);
    CHECK(plane.right() == c.right);
    CHECK(plane.up() == c.up);
    CHECK(plane.height() == std::lround(40 * kBox.size()[c.up] / kBox.size()[c.right]));
    const Vec3d corner = plane.at(0, 0), other = plane.at(40, plane.height());
    CHECK(corner[c.right] == Approx(kBox.lower[c.right]));
    CHECK(corner[c.up] == Approx(kBox.upper[c.up]));
    CHECK(other[c.right] == Approx(kBox.upper[c.right]));
    CHECK(corner[c.axis] == 0.5);

    const Image image = slice(kBox, fieldSource(places(), "value"), options);
    REQUIRE((image.width == 40 && image.height == plane.height()));
    REQUIRE(image.channels == std::vector<std::string>{"value"});
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            const Vec3d p = plane.at(x + 0.5, y + 0.5); // the mean of a ramp over a pixel is its value at the centre
            REQUIRE(image.at(x, y) == Approx(p[0] + 10 * p[1] + 100 * p[2]).margin(1e-3));
        }
}

TEST_CASE("PicturePlane: the margin is a fraction of the longer edge", "[picture]") {
    const PicturePlane plane(kBox, {.width = 100, .margin = 0.25});
    CHECK(plane.at(0, 0)[0] == Approx(-2));
    CHECK(plane.at(0, 0)[1] == Approx(3));
    CHECK(plane.height() == 150);
}

TEST_CASE("fieldSource: shows value and gradient and slope of a field", "[picture]") {
    const Image gradient = slice(kBox, fieldSource(places(), "gradient"), {.width = 8});
    REQUIRE(gradient.channels == std::vector<std::string>{"gradient.x", "gradient.y", "gradient.z"});
    CHECK(gradient.at(3, 3, 0) == Approx(1));
    CHECK(gradient.at(3, 3, 1) == Approx(10));
    CHECK(gradient.at(3, 3, 2) == Approx(100));
    CHECK(slice(kBox, fieldSource(places(), "slope"), {.width = 8}).at(2, 2) == Approx(std::sqrt(10101.0)));
    CHECK_THROWS_WITH(fieldSource(places(), "speed"), Catch::ContainsSubstring("value, gradient or slope"));
}

TEST_CASE("flowSource: shows velocity and speed and potentials and distance of a flow", "[picture]") {
    const Flow flow = containedFlow();
    const SliceOptions options{.width = 60, .supersampling = 1};
    const Box box = flow.domain().box;
    const PicturePlane plane(box, options);
    const Image velocity = slice(box, flowSource(flow, "velocity"), options);
    REQUIRE(velocity.channels.size() == 3);
    const Image f = slice(box, flowSource(flow, "f"), options), g = slice(box, flowSource(flow, "g"), options);
    const Image speed = slice(box, flowSource(flow, "speed"), options),
                vy = slice(box, flowSource(flow, "vy"), options);
    const Image distance = slice(box, flowSource(flow, "distance"), options);
    int shown = 0, hidden = 0;
    for (int y = 0; y < velocity.height; y += 3)
        for (int x = 0; x < velocity.width; x += 3) {
            const Vec3d p = plane.at(x + 0.5, y + 0.5);
            CAPTURE(x, y);
            const double d = flow.domain().wall->sdf.distance.at<0>(p).value;
            if (!(d < 0)) {
                CHECK(std::isnan(speed.at(x, y)));
                ++hidden;
                continue;
            }
            ++shown;
            const FlowSample sample = flow.at(p);
            const double size = length(sample.velocity);
            for (int axis = 0; axis < 3; ++axis)
                CHECK(velocity.at(x, y, axis) == Approx(sample.velocity[axis]).margin(1e-4 * (1 + size)));
            CHECK(speed.at(x, y) == Approx(size).margin(1e-4 * (1 + size)));
            CHECK(vy.at(x, y) == velocity.at(x, y, 1));
            CHECK(f.at(x, y) == Approx(sample.potentials[0]).margin(1e-4));
            CHECK(g.at(x, y) == Approx(sample.potentials[1]).margin(1e-4));
            CHECK(distance.at(x, y) == Approx(d).margin(1e-5));
        }
    CHECK(shown > 100);
    CHECK(hidden > 50);
    CHECK_THROWS_WITH(flowSource(flow, "value"), Catch::ContainsSubstring("speed, vx"));
}

TEST_CASE("slice: does not depend on the number of threads", "[picture]") {
    const auto pixels = [](int threads) {
        const ThreadLimit limit(threads);
        auto values =
            slice(kBox, flowSource(vortexFlow(1, 0.5, {.box = kBox, .wall = std::nullopt}), "speed"), {.width = 70})
                .pixels;
        std::replace_if(
            values.begin(), values.end(), [](float v) { return std::isnan(v); }, -1.0f);
        return values;
    };
    CHECK(pixels(1) == pixels(2));
}

TEST_CASE("slice: invalid boxes and options are refused", "[picture]") {
    const SliceSource source = fieldSource(places(), "value");
    CHECK_THROWS_AS(slice({{{0, 0, 0}}, {{0, 1, 1}}}, source, {}), ValueError);
    CHECK_THROWS_AS(slice({{{0, 0, 0}}, {{1e300 * 1e10, 1, 1}}}, source, {}), ValueError);
    CHECK_THROWS_AS(slice(kBox, source, {.width = 0}), ValueError);
    CHECK_THROWS_AS(slice(kBox, source, {.supersampling = 0}), ValueError);
    CHECK_THROWS_AS(slice(kBox, source, {.margin = -1}), ValueError);
    CHECK_THROWS_AS(slice(kBox, source, {.axis = 3}), ValueError);
    CHECK_THROWS_AS(slice({{{0, 0, 0}}, {{1e-6, 1, 1}}}, source, {.margin = 0}), ValueError);
}

TEST_CASE("alongSource: is the velocity component along a direction of any length", "[picture]") {
    const Flow flow = containedFlow();
    const SliceOptions options{.width = 50, .supersampling = 1};
    const Image velocity = slice(flow.domain().box, flowSource(flow, "velocity"), options);
    const Image along = slice(flow.domain().box, alongSource(flow, {{2, -1, 2}}), options);
    REQUIRE(along.channels == std::vector<std::string>{"along"});
    for (int y = 0; y < along.height; ++y)
        for (int x = 0; x < along.width; ++x) {
            const float expected = (2 * velocity.at(x, y, 0) - velocity.at(x, y, 1) + 2 * velocity.at(x, y, 2)) / 3;
            REQUIRE(std::isnan(along.at(x, y)) == std::isnan(expected));
            if (!std::isnan(expected)) REQUIRE(along.at(x, y) == Approx(expected).margin(1e-5));
        }
    CHECK_THROWS_AS(alongSource(flow, {}), ValueError);
}

TEST_CASE("wallSource: is the signed distance on both sides of the wall", "[picture]") {
    const Domain domain = containedFlow().domain();
    const SliceOptions options{.axis = 1, .width = 40, .supersampling = 1, .margin = 0.5};
    const PicturePlane plane(domain.box, options);
    const Image distance = slice(domain.box, wallSource(domain), options);
    for (int y = 0; y < distance.height; ++y)
        for (int x = 0; x < distance.width; ++x)
            REQUIRE(std::abs(distance.at(x, y)) ==
                    Approx(std::abs(length(plane.at(x + 0.5, y + 0.5)) - 0.8)).margin(1e-6));
    CHECK(distance.at(0, 0) * distance.at(20, 20) < 0);
}

TEST_CASE("inPlane: keeps the components to the right and up", "[picture]") {
    const int axis = GENERATE(0, 1, 2);
    const PicturePlane plane(kBox, {.axis = axis, .width = 4});
    Image vectors = filledImage(2, 1, {"v.x", "v.y", "v.z"});
    for (size_t k = 0; k < 6; ++k) vectors.pixels[k] = static_cast<float>(k);
    const Image flat = inPlane(vectors, plane);
    CHECK(flat.channels == std::vector<std::string>{"right", "up"});
    CHECK(flat.at(1, 0, 0) == static_cast<float>(3 + plane.right()));
    CHECK(flat.at(1, 0, 1) == static_cast<float>(3 + plane.up()));
}
