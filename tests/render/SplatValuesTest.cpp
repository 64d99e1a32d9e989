// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/render/Splat.h"
#include "curlew/render/SplatValues.h"
#include "support/Catch.h"

#include <limits>
#include <numeric>
#include <set>

using namespace curlew;

namespace {

const Camera kCamera({{0, 0, 10}}, {}, {{0, 1, 0}}, 30, 40, 30);

Points threePoints() {
    Points p;
    p.x = {0, 1, 2};
    p.y = {5, -3, 0.5};
    p.z = {0, 2, -4};
    p.id = {7, 8, 7};
    return p;
}

/// Two curves, of two vertices and of one.
Curves twoCurves() {
    Curves c;
    c.x = {0, 1, 2};
    c.y = {5, -3, 0.5};
    c.z = {0, 2, -4};
    c.vx = {3, 0, 0};
    c.vy = {4, 1, 0};
    c.vz = {0, 0, 2};
    c.along = {0, 0.5, 0};
    c.start = {0, 2, 3};
    c.id = {7, 8};
    return c;
}

} // namespace

TEST_CASE("splatValues: height is the y coordinate and depth is measured from the camera", "[render]") {
    CHECK(splatValues(threePoints(), SplatValue::height, kCamera) == std::vector<float>{5, -3, 0.5f});
    CHECK(splatValues(threePoints(), SplatValue::depth, kCamera) == std::vector<float>{10, 8, 14});
    CHECK(splatValues(twoCurves(), SplatValue::height, kCamera) == std::vector<float>{5, -3, 0.5f});
    CHECK(splatValues(twoCurves(), SplatValue::depth, kCamera) == std::vector<float>{10, 8, 14});
}

TEST_CASE("splatValues: speed and age come from the attributes of points and curves", "[render]") {
    Points p = threePoints();
    CHECK_THROWS_AS(splatValues(p, SplatValue::speed, kCamera), ValueError);
    CHECK_THROWS_AS(splatValues(p, SplatValue::age, kCamera), ValueError);
    p.vx = {3, 0, 0};
    p.vy = {4, 1, 0};
    p.vz = {0, 0, 2};
    p.age = {1, 2, 3};
    CHECK(splatValues(p, SplatValue::speed, kCamera) == std::vector<float>{5, 1, 2});
    CHECK(splatValues(p, SplatValue::age, kCamera) == p.age);
    CHECK(splatValues(twoCurves(), SplatValue::speed, kCamera) == std::vector<float>{5, 1, 2});
    CHECK(splatValues(twoCurves(), SplatValue::age, kCamera) == std::vector<float>{0, 0.5f, 0});
}

TEST_CASE("splatValues: id gives random values and index even ones", "[render]") {
    const auto ids = splatValues(threePoints(), SplatValue::id, kCamera);
    CHECK(ids[0] == ids[2]);
    CHECK(ids[0] != ids[1]);
    for (const float value : ids) CHECK((value >= 0 && value <= 1));
    CHECK(splatValues(threePoints(), SplatValue::index, kCamera) == std::vector<float>{0, 0.5f, 1});
    // All vertices of a curve have the same.
    const auto ofCurves = splatValues(twoCurves(), SplatValue::id, kCamera);
    CHECK(ofCurves == std::vector<float>{ids[0], ids[0], ids[1]});
    CHECK(splatValues(twoCurves(), SplatValue::index, kCamera) == std::vector<float>{0, 0, 1});
}

TEST_CASE("splatRange: lies between percentiles of the finite values", "[render]") {
    std::vector<float> values(101);
    std::iota(values.begin(), values.end(), 0.0f);
    CHECK(splatRange(values, SplatValue::speed) == Interval{2, 98});
    values.push_back(std::numeric_limits<float>::infinity());
    values.push_back(std::numeric_limits<float>::quiet_NaN());
    CHECK(splatRange(values, SplatValue::speed) == Interval{2, 98});
    CHECK(splatRange(values, SplatValue::index) == Interval{0, 1});
    CHECK(splatRange({3, 3, 3}, SplatValue::depth) == Interval{2.5, 3.5});
    CHECK(splatRange({}, SplatValue::depth) == Interval{0, 1});
    // Rounding errors do not count.
    const Interval rounded = splatRange({1, 1 + 1e-7F, 1 - 1e-7F}, SplatValue::speed);
    CHECK(rounded.lower == Approx(0.5));
    CHECK(rounded.upper == Approx(1.5));
}

TEST_CASE("splatRange: does not depend on how long the curves of a long list are", "[render]") {
    for (const size_t length : {2, 5, 20}) {
        std::vector<float> values(2 * kEnoughSplats);
        for (size_t k = 0; k < values.size(); ++k) values[k] = static_cast<float>(k % length);
        const Interval range = splatRange(values, SplatValue::speed);
        CAPTURE(length);
        CHECK(range.lower == 0);
        CHECK(range.upper == static_cast<double>(length - 1));
    }
}
