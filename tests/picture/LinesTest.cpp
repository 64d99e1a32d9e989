// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/picture/Lines.h"
#include "support/Catch.h"

#include <algorithm>
#include <cmath>
#include <limits>

using namespace curlew;

namespace {

/// Returns an image of a function of the pixel centres.
template <class F>
Image imageOf(int width, int height, const F& f) {
    Image image = filledImage(width, height, {"v"});
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) image.at(x, y) = static_cast<float>(f(x + 0.5, y + 0.5));
    return image;
}

double lengthOf(const std::vector<Segment>& lines) {
    double sum = 0;
    for (const Segment& s : lines) sum += std::hypot(s.x1 - s.x0, s.y1 - s.y0);
    return sum;
}

/// Returns the largest distance of the line ends from a circle, relative to its radius.
double offCircle(int size) {
    const double middle = size / 2.0, radius = 0.37 * size;
    const Image cone = imageOf(size, size, [&](double x, double y) {
        const double r = std::hypot(x - middle, y - middle) / radius;
        return r * r * r;
    });
    double worst = 0;
    for (const Segment& s : isoLines(cone, std::array{1.0}))
        worst = std::max(worst, std::abs(std::hypot(s.x0 - middle, s.y0 - middle) / radius - 1));
    return worst;
}

} // namespace

TEST_CASE("isoLines: lines of a ramp are straight at their level", "[picture]") {
    const Image ramp = imageOf(20, 10, [](double x, double) { return 2 * x; });
    const auto lines = isoLines(ramp, std::array{13.0});
    REQUIRE(lines.size() == 9);
    for (const Segment& s : lines) {
        CHECK(s.x0 == Approx(6.5));
        CHECK(s.x1 == Approx(6.5));
    }
    CHECK(lengthOf(lines) == Approx(9));
    CHECK(isoLines(ramp, std::array{-1.0, 100.0}).empty());
}

TEST_CASE("isoLines: lines of a smooth image are second-order accurate", "[picture]") {
    const double coarse = offCircle(40), fine = offCircle(80);
    CAPTURE(coarse, fine);
    CHECK(coarse < 0.01);
    CHECK(std::log2(coarse / fine) == Approx(2).margin(0.4));
    const double size = 80;
    const Image cone = imageOf(80, 80, [&](double x, double y) { return std::hypot(x - 40, y - 40) / (0.37 * size); });
    CHECK(lengthOf(isoLines(cone, std::array{1.0})) == Approx(2 * 3.14159265 * 0.37 * size).epsilon(0.002));
}

TEST_CASE("isoLines: a saddle has two lines that do not cross", "[picture]") {
    Image saddle = filledImage(2, 2, {"v"});
    saddle.pixels = {1, 0, 0, 1};
    for (const double level : {0.4, 0.6}) {
        CAPTURE(level);
        const auto lines = isoLines(saddle, std::array{level});
        REQUIRE(lines.size() == 2);
        // Below 0.5, the two corners with 1 are connected: each line cuts off a corner with 0.
        for (const Segment& s : lines) {
            const double alongDiagonal = s.x0 + s.y0 + s.x1 + s.y1;
            if (level < 0.5)
                CHECK(alongDiagonal == Approx(4).margin(1e-9));
            else
                CHECK(std::abs(alongDiagonal - 4) > 0.5);
        }
    }
}

TEST_CASE("isoLines: no lines are drawn next to NaN", "[picture]") {
    Image ramp = imageOf(20, 3, [](double x, double) { return x; });
    ramp.at(7, 1) = std::numeric_limits<float>::quiet_NaN();
    CHECK(isoLines(ramp, std::array{7.0}).empty());
    CHECK(isoLines(ramp, std::array{12.0}).size() == 2);
    CHECK_THROWS_AS(isoLines(filledImage(2, 2, {"a", "b"}), std::array{1.0}), ValueError);
}

TEST_CASE("evenLevels: divide a range evenly", "[picture]") {
    CHECK(evenLevels(-1, 1, 3) == std::vector<double>{-0.5, 0, 0.5});
    CHECK(evenLevels(0, 1, 0).empty());
}

TEST_CASE("arrows: point along their vectors and the longest fills its cell", "[picture]") {
    Image vectors = filledImage(60, 30, {"right", "up"});
    for (int y = 0; y < 30; ++y)
        for (int x = 0; x < 60; ++x)
            vectors.at(x, y, 1) = x < 30 ? 2.0f : 1.0f; // up, with half the length on the right
    const auto lines = arrows(vectors, 2);
    REQUIRE(lines.size() == 2 * 3); // the shaft and two strokes
    CHECK(lines[0].x0 == Approx(15));
    CHECK(lines[0].x1 == Approx(15));
    CHECK(lines[0].y0 - lines[0].y1 == Approx(27));
    CHECK(lines[0].y0 + lines[0].y1 == Approx(30));
    CHECK(lines[3].y0 - lines[3].y1 == Approx(13.5));
    // The strokes of the head begin at the tip and go back, one to each side.
    CHECK(lines[1].x0 == Approx(lines[0].x1));
    CHECK(lines[1].y1 > lines[1].y0);
    CHECK((lines[1].x1 - 15) * (lines[2].x1 - 15) < 0);
    CHECK(arrows(vectors, 2, 4)[0].y0 - arrows(vectors, 2, 4)[0].y1 == Approx(13.5));

    vectors.at(15, 15, 0) = std::numeric_limits<float>::quiet_NaN();
    CHECK(arrows(vectors, 2).size() == 3);
    CHECK(arrows(filledImage(10, 10, {"right", "up"}), 4).empty());
    CHECK_THROWS_AS(arrows(vectors, 0), ValueError);
    CHECK_THROWS_AS(arrows(filledImage(10, 10, {"v"}), 1), ValueError);
}

TEST_CASE("drawLines: coverage equals width times length", "[picture]") {
    const double width = GENERATE(0.5, 1.0, 1.5, 4.0);
    Image picture = filledImage(100, 100, {"R", "G", "B"});
    const Segment line{20.3, 30.2, 80.1, 61.7};
    drawLines(picture, {line}, {.color = {{1, 1, 1}}, .width = width});
    double sum = 0;
    for (int y = 0; y < 100; ++y)
        for (int x = 0; x < 100; ++x) sum += static_cast<double>(picture.at(x, y));
    CAPTURE(width);
    // Line ends are round: they add up to the area of a disc.
    const double length = lengthOf({line});
    CHECK(sum > 0.97 * width * length);
    CHECK(sum < 1.03 * width * length + 3.2 * (width / 2 + 0.5) * (width / 2 + 0.5));
    // Drawing the same line twice covers the same area.
    Image twice = filledImage(100, 100, {"R", "G", "B"});
    drawLines(twice, {line, line}, {.color = {{1, 1, 1}}, .width = width});
    CHECK(twice.pixels == picture.pixels);
}

TEST_CASE("drawLines: lines are clipped to the picture and NaN lines are skipped", "[picture]") {
    Image picture = filledImage(10, 10, {"R", "G", "B"});
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    drawLines(picture, {{-50, 5.5, 50, 5.5}, {nan, 0, 1, 1}, {-9, -9, -5, -5}, {20, 20, 1e9, 1e9}}, {.width = 1});
    CHECK(picture.at(0, 5) == Approx(0.9f));
    CHECK(picture.at(9, 5, 2) == Approx(0.9f));
    CHECK(picture.at(5, 3) == 0);
}

TEST_CASE("contours: levels are evenly spaced and symmetric about 0", "[picture]") {
    Image scalar = filledImage(201, 3, {"x"});
    for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 201; ++x) scalar.at(x, y) = static_cast<float>(x - 150) / 100; // -1.5 to 0.5
    std::vector<double> places;
    for (const Segment& line : contours(scalar, 3)) places.push_back((line.x0 + line.x1) / 2);
    std::sort(places.begin(), places.end());
    // The 0.5th percentile of 603 values in columns of 3 is the second column: -1.49. So the levels are 0 and ±0.745.
    // The upper one does not occur.
    REQUIRE(places.size() == 4);
    CHECK(places[1] == Approx(150.5 - 74.5).margin(1e-3));
    CHECK(places[2] == Approx(150.5).margin(1e-3));
    CHECK(contours(scalar, 0).empty());
}
