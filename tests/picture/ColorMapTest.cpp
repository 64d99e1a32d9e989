// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Random.h"
#include "curlew/picture/ColorMap.h"
#include "support/Catch.h"

#include <algorithm>
#include <cmath>
#include <limits>

using namespace curlew;

namespace {

constexpr float quietNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float most = std::numeric_limits<float>::max();

Image scalarImage(std::vector<float> values) {
    return {.width = static_cast<int>(values.size()), .height = 1, .channels = {"s"}, .pixels = std::move(values)};
}

/// Returns CIE L* of a display colour (IEC 61966-2-1, CIE 1976).
double lightness(const Vec3f& color) {
    const Vec3d weights{{0.2126, 0.7152, 0.0722}};
    double Y = 0;
    for (int i = 0; i < 3; ++i) {
        const double v = static_cast<double>(color[i]);
        Y += weights[i] * (v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
    }
    return 116 * std::cbrt(Y) - 16;
}

Vec3f bytes(int r, int g, int b) {
    return Vec3f{{static_cast<float>(r), static_cast<float>(g), static_cast<float>(b)}} * (1 / 255.0f);
}

void checkColor(const Vec3f& color, const Vec3f& expected, float tolerance) {
    for (int i = 0; i < 3; ++i) {
        CAPTURE(i);
        CHECK(color[i] == Approx(expected[i]).margin(static_cast<double>(tolerance)).epsilon(0));
    }
}

} // namespace

TEST_CASE("colorAt: viridis matches its published colours", "[picture]") {
    // The published table has 256 entries, of which those at 0, 1/4, 1/2, 3/4 and 1 are compared. In between, ours
    // interpolates over wider gaps (ColorMap.h).
    checkColor(colorAt(ColorMap::viridis, 0), bytes(68, 1, 84), 1e-6f);
    checkColor(colorAt(ColorMap::viridis, 0.25f), bytes(59, 82, 139), 0.017f);
    checkColor(colorAt(ColorMap::viridis, 0.5f), bytes(33, 145, 140), 0.017f);
    checkColor(colorAt(ColorMap::viridis, 0.75f), bytes(94, 201, 98), 0.017f);
    checkColor(colorAt(ColorMap::viridis, 1), bytes(253, 231, 37), 1e-6f);
}

TEST_CASE("colorAt: viridis and gray increase in lightness", "[picture]") {
    const auto map = GENERATE(ColorMap::viridis, ColorMap::gray);
    CAPTURE(static_cast<int>(map));
    for (int i = 0; i < 1000; ++i) {
        CAPTURE(i);
        const float t = static_cast<float>(i) / 1000;
        CHECK(lightness(colorAt(map, t)) < lightness(colorAt(map, t + 0.001f)));
    }
}

TEST_CASE("colorAt: the diverging map matches the colours of Moreland", "[picture]") {
    // The control points of the paper, with the three digits printed there.
    checkColor(colorAt(ColorMap::diverging, 0), {{0.230f, 0.299f, 0.754f}}, 1e-3f);
    checkColor(colorAt(ColorMap::diverging, 0.5f), {{0.865f, 0.865f, 0.865f}}, 1e-3f);
    checkColor(colorAt(ColorMap::diverging, 1), {{0.706f, 0.016f, 0.150f}}, 1e-3f);
    // The quarters of his table of bytes. The tolerance is half a byte of rounding there plus half a byte for rounded
    // constants.
    checkColor(colorAt(ColorMap::diverging, 0.25f), bytes(141, 176, 254), 1 / 255.0f);
    checkColor(colorAt(ColorMap::diverging, 0.75f), bytes(244, 154, 123), 1 / 255.0f);
}

TEST_CASE("colorAt: the diverging map is symmetric in lightness with its maximum in the middle", "[picture]") {
    for (uint64_t i = 0; i < 500; ++i) {
        const float t = static_cast<float>(randomUniform(1, i)) / 2;
        CAPTURE(t);
        const double left = lightness(colorAt(ColorMap::diverging, t));
        // The chords of the table change L* by less than 0.05. A byte step is 0.4.
        CHECK(left == Approx(lightness(colorAt(ColorMap::diverging, 1 - t))).margin(0.05).epsilon(0));
        CHECK(left < lightness(colorAt(ColorMap::diverging, t + (0.5f - t) * 0.1f)) + 1e-9);
    }
}

TEST_CASE("colorAt: colours are display values and t is clamped and NaN gives the neutral colour", "[picture]") {
    const auto map = GENERATE(ColorMap::viridis, ColorMap::diverging, ColorMap::gray);
    CAPTURE(static_cast<int>(map));
    for (uint64_t i = 0; i < 1000; ++i) {
        const float t = static_cast<float>(randomUniform(2, i));
        CAPTURE(t);
        for (const float part : colorAt(map, t).c) CHECK((part >= 0 && part <= 1));
    }
    CHECK(colorAt(map, -3) == colorAt(map, 0));
    CHECK(colorAt(map, -infinity) == colorAt(map, 0));
    CHECK(colorAt(map, 1.5f) == colorAt(map, 1));
    CHECK(colorAt(map, infinity) == colorAt(map, 1));
    CHECK(colorAt(map, quietNaN) == kNoValueColor);
    CHECK_FALSE(colorAt(map, 0) == colorAt(map, 1));
}

TEST_CASE("automaticScale: ignores the outermost half percent at both ends", "[picture]") {
    std::vector<float> values;
    for (int i = 0; i <= 1000; ++i) values.push_back(static_cast<float>((i * 387) % 1001) - 100);
    values[500] = quietNaN, values[501] = infinity, values[502] = -infinity;
    const ColorScale scale = automaticScale(scalarImage(values), ColorMap::gray);
    // Ranks 5 and 992 of 998 values; at most three values below are missing.
    CHECK((scale.lower >= -95 && scale.lower <= -92));
    CHECK((scale.upper >= 892 && scale.upper <= 895));
    CHECK(scale.map == ColorMap::gray);
}

TEST_CASE("automaticScale: viridis starts at 0 unless values are negative and diverging is symmetric", "[picture]") {
    const Image positive = scalarImage({2, 3, quietNaN, 5}), mixed = scalarImage({-1, 3, 5}),
                negative = scalarImage({-5, 1});
    CHECK(automaticScale(positive, ColorMap::viridis).lower == 0);
    CHECK(automaticScale(positive, ColorMap::viridis).upper == 5);
    CHECK(automaticScale(positive, ColorMap::gray).lower == 2);
    CHECK(automaticScale(mixed, ColorMap::viridis).lower == -1);
    CHECK(automaticScale(mixed, ColorMap::diverging).lower == -5);
    CHECK(automaticScale(mixed, ColorMap::diverging).upper == 5);
    CHECK(automaticScale(negative, ColorMap::diverging).upper == 5);
}

TEST_CASE("automaticScale: a few bright pixels on a constant background set the scale", "[picture]") {
    std::vector<float> values(1000, 0.0f);
    values[300] = 8, values[301] = 4;
    CHECK(automaticScale(scalarImage(values), ColorMap::viridis).upper == 8);
}

TEST_CASE("automaticScale: every image gets a valid scale", "[picture]") {
    const auto map = GENERATE(ColorMap::viridis, ColorMap::diverging, ColorMap::gray);
    CAPTURE(static_cast<int>(map));
    for (const float value : {0.0f, -0.0f, 1.0f, -3.0f, 1e-45f, -1e-45f, most, -most, quietNaN, infinity, -infinity}) {
        CAPTURE(value);
        const Image constant = scalarImage({value, value, value});
        const ColorScale scale = automaticScale(constant, map);
        CHECK(scale.lower < scale.upper);
        if (std::isfinite(value)) CHECK((scale.lower <= value && value <= scale.upper));
        CHECK_NOTHROW(colorize(constant, scale));
    }
    CHECK(automaticScale(Image{}, map).lower < automaticScale(Image{}, map).upper);
    CHECK(automaticScale(Image{}, ColorMap::diverging).lower == -1);
}

TEST_CASE("colorize: maps the range onto the colour map", "[picture]") {
    const ColorScale scale{.map = ColorMap::viridis, .lower = -2, .upper = 6};
    const Image picture = colorize(scalarImage({-2, 0, 6, 100, quietNaN}), scale);
    REQUIRE(picture.channels == std::vector<std::string>{"R", "G", "B"});
    REQUIRE(picture.width == 5);
    const float expected[] = {0, 0.25f, 1, 1, quietNaN};
    for (int x = 0; x < 5; ++x) {
        CAPTURE(x);
        const Vec3f color = colorAt(ColorMap::viridis, expected[x]);
        for (int i = 0; i < 3; ++i) CHECK(picture.at(x, 0, i) == color[i]);
    }
    const Image extreme = colorize(scalarImage({0}), {.map = ColorMap::gray, .lower = -most, .upper = most});
    CHECK(extreme.at(0, 0) == 0.5f);
}

TEST_CASE("colorize: invalid images and scales are refused", "[picture]") {
    const Image scalar = scalarImage({1});
    CHECK_THROWS_WITH(colorize(filledImage(1, 1, {"x", "y"}), {}), Catch::ContainsSubstring("x, y"));
    CHECK_THROWS_AS(colorize(Image{}, {}), ValueError);
    for (const auto& [lower, upper] : {std::pair{1.0f, 1.0f}, {2.0f, 1.0f}, {quietNaN, 1.0f}, {0.0f, infinity}}) {
        CAPTURE(lower, upper);
        CHECK_THROWS_AS(colorize(scalar, {.map = ColorMap::gray, .lower = lower, .upper = upper}), ValueError);
    }
}

TEST_CASE("commonScale: is the automatic scale of all single-channel images together", "[picture]") {
    Image a = filledImage(100, 10, {"a"}), b = filledImage(30, 20, {"b"});
    for (size_t k = 0; k < a.pixels.size(); ++k) a.pixels[k] = static_cast<float>(k);
    for (size_t k = 0; k < b.pixels.size(); ++k) b.pixels[k] = -2 * static_cast<float>(k);
    Image all = filledImage(1600, 1, {"all"});
    std::copy(b.pixels.begin(), b.pixels.end(), std::copy(a.pixels.begin(), a.pixels.end(), all.pixels.begin()));
    const ColorScale common = commonScale({a, filledImage(9, 9, {"R", "G", "B"}, 1e9f), b}, ColorMap::diverging);
    CHECK(common.upper == automaticScale(all, ColorMap::diverging).upper);
    CHECK(common.lower == -common.upper);
    CHECK(common.upper > 1000);
}
