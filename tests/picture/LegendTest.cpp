// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/picture/Legend.h"
#include "support/Catch.h"

#include <limits>
#include <string>

using namespace curlew;

namespace {

Vec3f pixel(const Image& image, int x, int y) { return {{image.at(x, y, 0), image.at(x, y, 1), image.at(x, y, 2)}}; }

bool bright(const Vec3f& color) { return color[0] > 0.8f && color[1] > 0.8f && color[2] > 0.8f; }

/// Returns the lit pixels of the title's line row by row, one character per pixel.
std::string titleInk(std::string_view title, int width = 200) {
    const int height = 4;
    const Image picture = withLegend(filledImage(width, height, {"s"}), {}, title);
    std::string ink;
    for (int y = height; y < height + 15; ++y)
        for (int x = 0; x < picture.width; ++x) ink += bright(pixel(picture, x, y)) ? '#' : ' ';
    return ink;
}

} // namespace

TEST_CASE("withLegend: the picture is unchanged above the legend", "[picture]") {
    Image scalar = filledImage(400, 30, {"s"});
    for (int x = 0; x < 400; ++x) scalar.at(x, 7) = static_cast<float>(x) / 400;
    scalar.at(5, 5) = std::numeric_limits<float>::quiet_NaN();
    const Image picture = withLegend(scalar, {}, "speed"), colored = colorize(scalar, {});
    REQUIRE(picture.width == 400);
    REQUIRE(picture.height == 30 + 56);
    REQUIRE_NOTHROW(checkImage(picture));
    CHECK(std::equal(colored.pixels.begin(), colored.pixels.end(), picture.pixels.begin()));
}

TEST_CASE("withLegend: a narrow picture is centred", "[picture]") {
    const Image picture = withLegend(filledImage(10, 20, {"s"}, 1), {}, "");
    REQUIRE(picture.width == 156);
    REQUIRE(picture.height == 20 + 28);
    const Vec3f top = colorAt(ColorMap::viridis, 1);
    CHECK(pixel(picture, 73, 0) == top);
    CHECK(pixel(picture, 82, 19) == top);
    CHECK_FALSE(pixel(picture, 72, 0) == top);
    CHECK_FALSE(pixel(picture, 83, 0) == top);
}

TEST_CASE("withLegend: the bar covers the whole map from left to right", "[picture]") {
    const auto map = GENERATE(ColorMap::viridis, ColorMap::diverging);
    CAPTURE(static_cast<int>(map));
    const Image picture = withLegend(filledImage(600, 1, {"s"}), {.map = map, .lower = 0, .upper = 1}, "");
    const int y = 1 + 2 * 20;
    int first = -1, last = -1;
    for (int x = 0; x < 600; ++x) {
        if (pixel(picture, x, y) == colorAt(map, 0) && first < 0) first = x;
        if (pixel(picture, x, y) == colorAt(map, 1)) last = x;
    }
    CAPTURE(first, last);
    REQUIRE(first > 0);
    REQUIRE(last - first > 500);
    const Vec3f middle = pixel(picture, (first + last) / 2, y), expected = colorAt(map, 0.5f);
    for (int i = 0; i < 3; ++i) CHECK(middle[i] == Approx(expected[i]).margin(0.01));
}

TEST_CASE("withLegend: the numbers at both ends are those of the scale", "[picture]") {
    const Image scalar = filledImage(300, 1, {"s"});
    const auto legend = [&](float lower, float upper) {
        return withLegend(scalar, {.map = ColorMap::gray, .lower = lower, .upper = upper}, "").pixels;
    };
    CHECK(legend(0, 1) == legend(-0.0f, 1));
    CHECK(legend(0, 1.0001f) == legend(0, 1));
    CHECK_FALSE(legend(0, 1) == legend(0, 2));
    CHECK_FALSE(legend(0, 1) == legend(-1, 1));
    constexpr float most = std::numeric_limits<float>::max();
    CHECK_NOTHROW(legend(-most, most));
}

TEST_CASE("withLegend: unknown characters of a title become boxes and capitals small letters", "[picture]") {
    const std::string box = titleInk("\x7f");
    CHECK(titleInk("a") != box);
    for (const char* unknown : {"?", "\xe9", "~", "\n"}) CHECK(titleInk(unknown) == box);
    CHECK(titleInk("ABYZ") == titleInk("abyz"));
}

TEST_CASE("withLegend: a long title is truncated to the width of the picture", "[picture]") {
    const std::string longTitle(100000, 'w');
    const Image picture = withLegend(filledImage(400, 8, {"s"}), {}, longTitle);
    REQUIRE(picture.width == 400);
    bool inkAtLeft = false, inkAtRight = false;
    for (int y = 8; y < picture.height; ++y) {
        inkAtLeft = inkAtLeft || bright(pixel(picture, 11, y));
        for (int x = 391; x < 400; ++x) inkAtRight = inkAtRight || bright(pixel(picture, x, y));
    }
    CHECK(inkAtLeft);
    CHECK_FALSE(inkAtRight);
    // 24 characters of 6 pixels fit into a width of 156 pixels with margins. With a 25th, there is room for 22 and two
    // dots.
    const std::string fits(24, 'x');
    CHECK(titleInk(fits + "x", 156) == titleInk(fits.substr(2) + "..", 156));
    CHECK_FALSE(titleInk(fits, 156) == titleInk(fits + "x", 156));
}

TEST_CASE("withLegend: more than one channel or an empty range is refused", "[picture]") {
    CHECK_THROWS_AS(withLegend(filledImage(8, 8, {"R", "G", "B"}), {}, "t"), ValueError);
    CHECK_THROWS_AS(withLegend(filledImage(8, 8, {"s"}), {.lower = 1, .upper = 1}, "t"), ValueError);
}
