// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Random.h"
#include "curlew/math/Fade.h"
#include "support/Catch.h"

#include <cmath>

using namespace curlew;

TEST_CASE("quinticFade: rises from 0 to 1 with zero slope and curvature at both ends", "[math]") {
    for (const double s : {-1e300, -1.0, -1e-300, 0.0}) {
        const auto fade = quinticFade(s);
        CAPTURE(s);
        CHECK((fade.value == 0 && fade.first == 0 && fade.second == 0));
    }
    for (const double s : {1.0, 1.0000001, 1e300}) {
        const auto fade = quinticFade(s);
        CAPTURE(s);
        CHECK((fade.value == 1 && fade.first == 0 && fade.second == 0));
    }
    // Just inside: |p| <= 10 s³, 30 s², 60 s, where s is the distance to the end.
    for (const double e : {0x1p-10, 0x1p-20, 0x1p-30}) {
        const auto low = quinticFade(e), high = quinticFade(1 - e);
        CAPTURE(e);
        CHECK((low.value <= 10 * e * e * e && low.first <= 30 * e * e && low.second <= 60 * e));
        CHECK(std::abs(high.value - 1) <= 10 * e * e * e + 0x1p-50);
        CHECK((high.first <= 30 * e * e && high.second >= -60 * e));
    }
}

TEST_CASE("quinticFade: has known values and is symmetric about the middle", "[math]") {
    constexpr auto middle = quinticFade(0.5);
    STATIC_REQUIRE(middle.value == 0.5);
    STATIC_REQUIRE(middle.first == 1.875);
    STATIC_REQUIRE(middle.second == 0);
    STATIC_REQUIRE(quinticFade(0.25).value == 0.103515625); // 106/1024
    double last = 0;
    for (int k = 1; k < 1000; ++k) {
        const double s = k / 1000.0;
        const auto a = quinticFade(s), b = quinticFade(1 - s);
        CAPTURE(s);
        // Tolerances: a few roundings of polynomials whose terms are at most 15, 30 and 60.
        REQUIRE(std::abs(a.value + b.value - 1) < 1e-14);
        REQUIRE(std::abs(a.first - b.first) < 1e-13);
        REQUIRE(std::abs(a.second + b.second) < 1e-13);
        REQUIRE(a.value > last);
        last = a.value;
    }
}

TEST_CASE("quinticFade: first and second derivatives agree with central differences", "[math]") {
    // f''' = 360 s² - 360 s + 60 and f'''' = 720 s - 360 bound the errors of central differences: at most 60 and 360
    // times h²/6 within [0, 1]. s stays away from the ends.
    for (uint64_t k = 0; k < 1000; ++k) {
        const double s = 0.01 + 0.98 * randomUniform(1, k);
        const auto fade = quinticFade(s);
        CAPTURE(s);
        for (const double h : {1e-2 / 2, 1e-3, 1e-4}) {
            const auto up = quinticFade(s + h), down = quinticFade(s - h);
            REQUIRE(std::abs((up.value - down.value) / (2 * h) - fade.first) <= 10.01 * h * h + 1e-15 / h);
            REQUIRE(std::abs((up.first - down.first) / (2 * h) - fade.second) <= 60.1 * h * h + 1e-14 / h);
        }
    }
    CHECK(std::abs(double(quinticFade(0.3f).value) - quinticFade(0.3).value) < 1e-6); // in float: a few roundings of 1
}

TEST_CASE("quinticFade: the third derivative agrees with central differences of the second", "[math]") {
    constexpr auto middle = quinticFade(0.5);
    STATIC_REQUIRE(middle.third == -30);
    STATIC_REQUIRE(quinticFade(0.0).third == 0); // the third derivative jumps at both ends, from 0 to 60
    STATIC_REQUIRE(quinticFade(1.0).third == 0);
    STATIC_REQUIRE(quinticFade(-2.0).third == 0);
    CHECK(std::abs(quinticFade(1e-9).third - 60) < 1e-6);
    CHECK(std::abs(quinticFade(1 - 1e-9).third - 60) < 1e-6);
    // The fifth derivative is 720, so the error is exactly 720 h²/6, except for rounding of terms of at most 60 over h.
    for (uint64_t k = 0; k < 300; ++k) {
        const double s = 0.01 + 0.98 * randomUniform(2, k);
        CAPTURE(s);
        for (const double h : {1e-2 / 2, 1e-3}) {
            const double difference = (quinticFade(s + h).second - quinticFade(s - h).second) / (2 * h);
            REQUIRE(std::abs(difference - quinticFade(s).third - 120 * h * h) <= 1e-13 / h);
        }
    }
}
