// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/picture/Lic.h"
#include "support/Catch.h"

#include <cmath>
#include <limits>

using namespace curlew;

namespace {

constexpr int kSize = 120;

/// Returns a value minus 0.5, the mean of all values.
double value(const Image& image, int x, int y) { return static_cast<double>(image.at(x, y)) - 0.5; }

template <class F>
Image vectorsOf(const F& f) {
    Image image = filledImage(kSize, kSize, {"right", "up"});
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x) {
            const auto [right, up] = f(x + 0.5 - kSize / 2.0, kSize / 2.0 - y - 0.5);
            image.at(x, y, 0) = static_cast<float>(right);
            image.at(x, y, 1) = static_cast<float>(up);
        }
    return image;
}

Image along(double right, double up) {
    return vectorsOf([=](double, double) { return std::pair(right, up); });
}

/// Returns the correlation between the values of pixels at the distance (dx, dy).
double correlation(const Image& image, int dx, int dy) {
    double sum = 0, squares = 0;
    for (int y = 10; y < kSize - 10; ++y)
        for (int x = 10; x < kSize - 10; ++x) {
            const double a = value(image, x, y), b = value(image, x + dx, y + dy);
            sum += a * b;
            squares += a * a;
        }
    return sum / squares;
}

} // namespace

TEST_CASE("lic: streaks follow the vectors", "[picture]") {
    const auto kernel = GENERATE(LicKernel::hann, LicKernel::box);
    const LicOptions options{.length = 40, .kernel = kernel, .grain = 1};
    const Image level = lic(along(3, 0), options), upright = lic(along(0, -0.01), options),
                rising = lic(along(1, 1), options);
    CHECK(correlation(level, 4, 0) > 0.75);
    CHECK(std::abs(correlation(level, 0, 4)) < 0.2);
    CHECK(correlation(upright, 0, 4) > 0.75);
    CHECK(std::abs(correlation(upright, 4, 0)) < 0.2);
    CHECK(correlation(rising, 3, -3) > 0.7); // up is towards smaller y
    CHECK(std::abs(correlation(rising, 3, 3)) < 0.2);
}

TEST_CASE("lic: a box kernel is the mean of the noise along the streak", "[picture]") {
    // Two pixels at a distance a on a line share the fraction 1 - a / length of their streaks.
    const LicOptions options{.length = 40, .kernel = LicKernel::box, .grain = 1, .contrast = 0.1};
    const Image image = lic(along(1, 0), options);
    double sum = 0, squares = 0;
    for (const float pixel : image.pixels) {
        const auto v = static_cast<double>(pixel);
        sum += v;
        squares += v * v;
    }
    const double mean = sum / static_cast<double>(image.pixels.size());
    CHECK(mean == Approx(0.5).margin(0.01));
    CHECK(std::sqrt(squares / static_cast<double>(image.pixels.size()) - mean * mean) == Approx(0.1).margin(0.005));
    for (const int apart : {5, 10, 20}) {
        CAPTURE(apart);
        CHECK(correlation(image, apart, 0) == Approx(1 - apart / 40.0).margin(0.12));
    }
}

TEST_CASE("lic: streaks follow circles", "[picture]") {
    const Image image = lic(vectorsOf([](double x, double y) { return std::pair(-y, x); }), {.length = 60, .grain = 1});
    double alongSum = 0, acrossSum = 0;
    const auto at = [&](double radius, double angle) {
        return value(image, static_cast<int>(60 + radius * std::cos(angle)),
                     static_cast<int>(60 - radius * std::sin(angle)));
    };
    for (int k = 0; k < 2000; ++k) {
        const double angle = 0.00314159 * k, radius = 20 + k % 30;
        alongSum += at(radius, angle) * at(radius, angle + 6 / radius);
        acrossSum += at(radius, angle) * at(radius + 6, angle);
    }
    CAPTURE(alongSum, acrossSum);
    CHECK(alongSum > 4 * std::abs(acrossSum));
}

TEST_CASE("lic: NaN stays NaN and ends streaks", "[picture]") {
    Image vectors = along(1, 0);
    for (int y = 0; y < kSize; ++y) vectors.at(60, y, 1) = std::numeric_limits<float>::quiet_NaN();
    const Image cut = lic(vectors, {.length = 40, .contrast = 0.05}),
                whole = lic(along(1, 0), {.length = 40, .contrast = 0.05});
    bool same = true;
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x) same = same && (x == 60) == std::isnan(cut.at(x, y));
    CHECK(same);
    // The two sides of the gap are uncorrelated.
    double sum = 0, squares = 0;
    for (int y = 0; y < kSize; ++y) {
        sum += value(cut, 58, y) * value(cut, 62, y);
        squares += value(cut, 58, y) * value(cut, 58, y);
    }
    CHECK(std::abs(sum / squares) < 0.3);
    CHECK_FALSE(std::isnan(whole.at(60, 60)));
}

TEST_CASE("lic: depends on the seed and not on the number of threads", "[picture]") {
    const Image vectors = along(1, 0.3);
    const auto pixels = [&](int threads, uint64_t seed) {
        const ThreadLimit limit(threads);
        return lic(vectors, {.seed = seed}).pixels;
    };
    CHECK(pixels(1, 0) == pixels(2, 0));
    CHECK_FALSE(pixels(1, 0) == pixels(1, 1));
    // Where the flow is zero, the image is the noise itself.
    CHECK(std::abs(correlation(lic(along(0, 0), {.grain = 1}), 2, 0)) < 0.1);
}

TEST_CASE("litBy: modulates a picture by the streaks", "[picture]") {
    Image light = filledImage(2, 1, {"lic"});
    light.pixels = {1, std::numeric_limits<float>::quiet_NaN()};
    const Image picture = filledImage(2, 1, {"R", "G", "B"}, 0.5f), lit = litBy(light, picture);
    CHECK(lit.at(0, 0, 1) > 0.5f);
    CHECK(lit.at(1, 0, 1) == 0.5f);
    CHECK_THROWS_AS(litBy(filledImage(3, 1, {"lic"}), picture), ValueError);
}

TEST_CASE("lic: invalid images and options are refused", "[picture]") {
    CHECK_THROWS_AS(lic(filledImage(4, 4, {"speed"})), ValueError);
    CHECK_THROWS_AS(lic(along(1, 0), {.length = 0}), ValueError);
    CHECK_THROWS_AS(lic(along(1, 0), {.grain = -1}), ValueError);
    CHECK_THROWS_AS(lic(along(1, 0), {.contrast = std::numeric_limits<double>::quiet_NaN()}), ValueError);
    Monitor stop;
    stop.cancelled = [] { return true; };
    CHECK_THROWS_AS(lic(along(1, 0), {}, stop), Interrupted);
}

TEST_CASE("lic: NaN beside a streak does not end it", "[picture]") {
    const LicOptions options{.length = 40, .grain = 1};
    const Image whole = along(1, 0);
    Image noise = filledImage(kSize + 1, kSize + 1, {"noise"});
    for (size_t k = 0; k < noise.pixels.size(); ++k) noise.pixels[k] = static_cast<float>(k * 7919 % 101) / 101;
    Image cut = whole;
    constexpr int kEdge = kSize / 2;
    for (int y = kEdge; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x) cut.at(x, y, 0) = std::numeric_limits<float>::quiet_NaN();
    const Image a = convolved(whole, noise, options), b = convolved(cut, noise, options);
    for (int y = 0; y < kEdge; ++y)
        for (int x = 0; x < kSize; ++x) REQUIRE(a.at(x, y) == b.at(x, y));
}

TEST_CASE("LicOptions: the number of steps is limited", "[picture]") {
    CHECK(LicOptions{.length = 48}.steps() == 48);
    CHECK(LicOptions{.length = 1e-9}.steps() == 1);
    CHECK(LicOptions{.length = 1e12}.steps() == 1000000);
}
