// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Formula.h"
#include "curlew/field/NoiseField.h"
#include "curlew/picture/ColorMap.h"
#include "curlew/picture/Warp.h"
#include "support/Catch.h"

#include <cmath>
#include <limits>

using namespace curlew;

namespace {

using Position = Vec<double, 2>;
using Flow2 = FlowN<2>;

/// (f_y, -f_x) of f = -(x² + y²) / 2: a counter-clockwise rotation, one radian per second.
Flow2 rotation() {
    return Flow2(Flow2::Potentials{
        formulaField<2>([](const auto& x, const auto& k) { return (x[0] * x[0] + x[1] * x[1]) * k(-0.5); })});
}

Flow2 noiseFlow() { return Flow2(Flow2::Potentials{noiseField<GradientNoise<2>>({}, {.frequency = 3})}); }

Position turned(const Position& p, double angle) {
    return {{p[0] * std::cos(angle) - p[1] * std::sin(angle), p[0] * std::sin(angle) + p[1] * std::cos(angle)}};
}

/// Returns the error of the end position for a rotation.
double error(Scheme scheme, int steps, int corrections) {
    std::vector<Position> p{{{1, 0}}, {{0.3, -0.7}}};
    const auto start = p;
    warp(rotation(), p, {.time = 1, .steps = steps, .scheme = scheme, .corrections = corrections});
    double worst = 0;
    for (size_t k = 0; k < p.size(); ++k) worst = std::max(worst, length(p[k] - turned(start[k], 1)));
    return worst;
}

/// Returns how far positions drift off their tracks.
double drift(const WarpOptions& options) {
    const Flow2 flow = noiseFlow();
    std::vector<Position> p;
    for (int k = 0; k < 200; ++k) p.push_back({{0.013 * k, 1.7 - 0.029 * k}});
    const auto start = p;
    warp(flow, p, options);
    double worst = 0;
    for (size_t k = 0; k < p.size(); ++k)
        worst = std::max(worst, std::abs(flow.f().at<0>(p[k]).value - flow.f().at<0>(start[k]).value));
    return worst;
}

} // namespace

TEST_CASE("warp: has the order of its scheme", "[picture]") {
    const auto [scheme, order] =
        GENERATE(table<Scheme, double>({{Scheme::euler, 1}, {Scheme::midpoint, 2}, {Scheme::rk4, 4}}));
    const double coarse = error(scheme, 16, 0), fine = error(scheme, 32, 0);
    CAPTURE(order, coarse, fine);
    CHECK(std::log2(coarse / fine) == Approx(order).margin(0.15));
}

TEST_CASE("warp: each reprojection brings positions closer to their tracks", "[picture]") {
    const double none = drift({.steps = 64, .corrections = 0}), one = drift({.steps = 64, .corrections = 1}),
                 ten = drift({.steps = 64, .corrections = 10});
    CAPTURE(none, one, ten);
    CHECK(one < 0.1 * none);
    CHECK(ten < 1e-13);
    // The same on circles, where Euler steps lead outwards.
    CHECK(error(Scheme::euler, 16, 10) < 0.2 * error(Scheme::euler, 16, 0));
}

TEST_CASE("warp: backward returns to the start for any number of threads", "[picture]") {
    const auto forth = [](int threads) {
        const ThreadLimit limit(threads);
        std::vector<Position> p;
        for (int k = 0; k < 300; ++k) p.push_back({{0.01 * k, 0.3}});
        warp(noiseFlow(), p, {.time = 0.2});
        return p;
    };
    auto p = forth(1);
    CHECK(p == forth(2));
    warp(noiseFlow(), p, {.time = -0.2});
    for (size_t k = 0; k < p.size(); ++k) REQUIRE(length(p[k] - Position{{0.01 * static_cast<double>(k), 0.3}}) < 1e-4);
}

TEST_CASE("wavePattern: follows its formula", "[picture]") {
    // y + 0.05 |cos(10 π (x - y))| + 1213.12 has the fraction 0.17: stripe 1, 17 mod 13 = 4 of 13.
    CHECK(wavePattern({{0.3, 0.3}}) == colorAt(ColorMap::viridis, static_cast<float>(17 * 4 % 13) / 13));
    CHECK(wavePattern({{0, 0}}) == colorAt(ColorMap::viridis, static_cast<float>(17 % 13) / 13));
    CHECK(wavePattern({{0.05, 0}}) == colorAt(ColorMap::viridis, static_cast<float>(17 % 13) / 13));
    CHECK(wavePattern({{0.05, 0.2}}) == wavePattern({{0.05, 1.2}}));
}

TEST_CASE("textureOf: interpolates an image linearly on a box", "[picture]") {
    Image image = filledImage(4, 2, {"R", "G", "B"});
    for (int y = 0; y < 2; ++y)
        for (int x = 0; x < 4; ++x)
            image.at(x, y, 0) = static_cast<float>(x), image.at(x, y, 1) = static_cast<float>(y);
    const BoxN<2> box{{{1, 10}}, {{5, 12}}};
    const Texture2 texture = textureOf(image, box);
    CHECK(texture({{1.5, 11.5}}) == Vec3f{{0, 0, 0}}); // the centre of the upper left pixel
    CHECK(texture({{3.25, 11}})[0] == Approx(1.75));
    CHECK(texture({{3.25, 11}})[1] == Approx(0.5));
    CHECK(texture({{-100, 100}}) == Vec3f{{0, 0, 0}});
    CHECK(texture({{100, -100}})[0] == 3);
    CHECK_THROWS_AS(textureOf(image, {{{0, 0}}, {{0, 1}}}), ValueError);
    CHECK_THROWS_AS(textureOf(filledImage(2, 2, {"R", "G"}), box), ValueError);
}

TEST_CASE("warpedPicture: zero time changes nothing and a rotation rotates the image", "[picture]") {
    Image image = filledImage(40, 40, {"R", "G", "B"});
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 40; ++x)
            image.at(x, y, 0) = static_cast<float>(x), image.at(x, y, 1) = static_cast<float>(y);
    const BoxN<2> box = BoxN<2>{}.padded(1);
    const Texture2 texture = textureOf(image, box);
    const Image still = warpedPicture(rotation(), texture, box, 40, 40, {.time = 0, .steps = 1});
    for (size_t k = 0; k < image.pixels.size(); ++k) REQUIRE(still.pixels[k] == Approx(image.pixels[k]).margin(1e-4));
    // A counter-clockwise quarter turn moves the pixel at the right edge to the top.
    const Image quarter = warpedPicture(rotation(), texture, box, 40, 40, {.time = std::acos(0.0)});
    CHECK(quarter.at(39, 20, 0) == Approx(image.at(20, 0, 0)).margin(1e-3));
    CHECK(quarter.at(39, 20, 1) == Approx(image.at(20, 0, 1)).margin(1e-3));
    // The mean of a linear function over a pixel is its value at the centre.
    const Image smooth = warpedPicture(rotation(), texture, box, 40, 40, {.time = std::acos(0.0), .supersampling = 3});
    CHECK(smooth.at(30, 20, 0) == Approx(quarter.at(30, 20, 0)).margin(1e-3));
}

TEST_CASE("warp: unsuitable flows and options are refused", "[picture]") {
    std::vector<Position> p{{{0, 0}}};
    CHECK_THROWS_AS(warp(rotation(), p, {.steps = -1}), ValueError);
    CHECK_THROWS_AS(warp(rotation(), p, {.corrections = -1}), ValueError);
    CHECK_THROWS_AS(warp(rotation(), p, {.scheme = Scheme::rk4}), ValueError); // it has no error estimate
    CHECK_THROWS_AS(warp(rotation(), p, {.time = std::numeric_limits<double>::infinity()}), ValueError);
    CHECK_THROWS_AS(warp(rotation() + noiseFlow(), p, {}), ValueError);
    CHECK_NOTHROW(warp(rotation() + noiseFlow(), p, {.corrections = 0}));
    const BoxN<2> box = BoxN<2>{}.padded(1);
    CHECK_THROWS_AS(warpedPicture(rotation(), wavePattern, box, 0, 10, {}), ValueError);
    CHECK_THROWS_AS(warpedPicture(rotation(), wavePattern, box, 10, 10, {.supersampling = 0}), ValueError);
    CHECK_THROWS_AS(warpedPicture(rotation(), wavePattern, {}, 10, 10, {}), ValueError);
}

TEST_CASE("differenceOf: is the rms and maximum difference of two images", "[picture]") {
    Image a = filledImage(2, 2, {"v"}, 1), b = a;
    CHECK(differenceOf(a, b).rms == 0);
    b.pixels = {1, 1, 1, 3};
    CHECK(differenceOf(a, b).rms == Approx(1));
    CHECK(differenceOf(a, b).largest == 2);
    constexpr float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
    a.pixels = {nan, 1, infinity, 0};
    b.pixels = {nan, nan, infinity, 1};
    const ImageDifference difference = differenceOf(a, b);
    CHECK(difference.unmatched == 1);
    CHECK(difference.rms == Approx(std::sqrt(0.5)));
    CHECK_THROWS_AS(differenceOf(a, filledImage(2, 3, {"v"})), ValueError);
    CHECK_THROWS_AS(differenceOf(a, filledImage(2, 2, {"v", "w"})), ValueError);
}

TEST_CASE("textureOf and wavePattern: a coordinate that is not finite has no colour", "[picture]") {
    const Texture2 texture = textureOf(filledImage(4, 4, {"R", "G", "B"}), {{{0, 0}}, {{1, 1}}});
    const double infinity = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
    for (const double bad : {nan, infinity, -infinity})
        for (const auto& p : {Vec<double, 2>{{bad, 0.5}}, Vec<double, 2>{{0.5, bad}}}) {
            CHECK(texture(p) == kNoValueColor);
            CHECK(wavePattern(p) == kNoValueColor);
        }
    CHECK(texture({{0.5, 0.5}}) != kNoValueColor);
}
