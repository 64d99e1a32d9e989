// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/picture/ImageField.h"
#include "support/FiniteDifference.h"
#include "support/Points.h"

#include <cmath>
#include <limits>
#include <numbers>

using namespace curlew;
using Catch::Matchers::ContainsSubstring;
using Vec2d = Vec<double, 2>;

namespace {

/// A function of the plane with period 2 along both axes.
double wave(const Vec2d& p) {
    return std::sin(std::numbers::pi * p[0]) + std::cos(std::numbers::pi * (2 * p[0] + p[1]));
}

/// A square picture whose pixels are the values of a function at their centres.
template <class Function>
Image pictureOf(int size, const Function& function) {
    Image image = filledImage(size, size, {"value"});
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x)
            image.at(x, y) = static_cast<float>(function(Vec2d{{(2 * x + 1.0) / size - 1, 1 - (2 * y + 1.0) / size}}));
    return image;
}

double errorOf(const ScalarFieldN<2>& field) {
    double worst = 0;
    for (const Vec2d& p : test::randomPoints(test::cube<2>(1), 500, 1))
        worst = std::max(worst, std::abs(field.at<0>(p).value - wave(p)));
    return worst;
}

} // namespace

TEST_CASE("imageField: approximates a smooth picture with fourth order", "[picture]") {
    const double coarse = errorOf(imageField(pictureOf(16, wave), "", ImageWrap::repeat));
    const double fine = errorOf(imageField(pictureOf(32, wave), "", ImageWrap::repeat));
    CAPTURE(coarse, fine);
    CHECK(test::observedOrder(coarse, fine) > 3.8);
    CHECK(fine < 1e-3);
}

TEST_CASE("imageField: all derivatives are exact", "[picture]") {
    const auto field = imageField(pictureOf(16, wave), "value", ImageWrap::repeat);
    const auto points = test::randomPoints(test::cube<2>(3), 300, 2); // also beyond the picture
    test::requireDerivatives(field, points, 0.01, 2000);
    test::requireThirdDerivatives(field, points, 0.004, 0.2);
}

TEST_CASE("imageField: a ramp keeps its direction, and a constant its value", "[picture]") {
    const auto ramp = imageField(pictureOf(20, [](const Vec2d& p) { return p[0] + 3 * p[1]; }));
    const auto jet = ramp.at<1>({{0.13, -0.2}}); // away from the edges
    CHECK(jet.value == Approx(0.13 - 0.6).margin(1e-6));
    CHECK(jet.gradient[0] == Approx(1).margin(1e-5));
    CHECK(jet.gradient[1] == Approx(3).margin(1e-5));
    CHECK(imageField(filledImage(7, 3, {"value"}, 0.25f)).at<0>({{5, -8}}).value == Approx(0.25).margin(1e-6));
    // The longer edge of a picture reaches from -1 to 1.
    Image wide = filledImage(40, 20, {"value"});
    for (int x = 0; x < 40; ++x)
        for (int y = 0; y < 20; ++y) wide.at(x, y) = static_cast<float>((2 * y + 1.0) / 40);
    CHECK(imageField(wide).at<0>({{0.1, 0.0}}).value == Approx(0.5).margin(1e-6));
    CHECK(imageField(wide).at<1>({{0.1, 0.0}}).gradient[1] == Approx(-1).margin(1e-5));
}

TEST_CASE("imageField: continues beyond its edges as wrap says", "[picture]") {
    const Image image = pictureOf(12, [](const Vec2d& p) { return p[0] * p[0] * p[0] + 0.3 * p[1] * p[0] + p[1]; });
    for (const Vec2d& p : test::randomPoints(test::cube<2>(1), 100, 3)) {
        const auto repeat = imageField(image, "", ImageWrap::repeat), mirror = imageField(image, "", ImageWrap::mirror);
        CHECK(repeat.at<0>(p + Vec2d{{2, -4}}).value == Approx(repeat.at<0>(p).value).margin(1e-6));
        CHECK(mirror.at<0>(Vec2d{{2 - p[0], p[1]}}).value == Approx(mirror.at<0>(p).value).margin(1e-6));
        CHECK(mirror.at<0>(p + Vec2d{{4, 8}}).value == Approx(mirror.at<0>(p).value).margin(1e-6));
    }
    const auto clamp = imageField(image);
    CHECK(clamp.at<1>({{3, 0.5}}).gradient[0] == 0);
}

TEST_CASE("imageField: chooses a channel, or the luminance", "[picture]") {
    Image color = filledImage(4, 4, {"R", "G", "B", "A"}, 1);
    for (size_t k = 0; k < color.pixels.size(); k += 4) color.pixels[k] = 0.5f, color.pixels[k + 3] = 0.125f;
    CHECK(imageField(color).at<0>({}).value == Approx(0.5 * 0.2126 + 0.7152 + 0.0722).margin(1e-6));
    CHECK(imageField(color, "A").at<0>({}).value == Approx(0.125).margin(1e-6));
    CHECK_THROWS_WITH(imageField(color, "Z"), ContainsSubstring("'Z'") && ContainsSubstring("R, G, B, A"));
    CHECK_THROWS_WITH(imageField(filledImage(4, 4, {"u", "v"})), ContainsSubstring("channel="));
    color.pixels[4] = std::numeric_limits<float>::quiet_NaN();
    CHECK_THROWS_WITH(imageField(color), ContainsSubstring("1 of 16"));
    CHECK_NOTHROW(imageField(color, "A"));
    CHECK_THROWS_AS(imageField(Image{}), ValueError);
}
