// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/picture/Display.h"
#include "support/Catch.h"

using namespace curlew;

TEST_CASE("displayFromLinear: follows IEC 61966-2-1 and extends beyond black and white", "[picture]") {
    CHECK(displayFromLinear(0) == 0);
    CHECK(displayFromLinear(1) == Approx(1));
    CHECK(linearFromDisplay(0.5) == Approx(0.214041).margin(1e-6)); // the curve of the standard
    CHECK(displayFromLinear(0.18) == Approx(0.461356).margin(1e-6));
    for (const double linear : {-3.0, -0.2, 1e-4, 0.0031308, 0.01, 0.7, 1.0, 5.0, 1000.0}) {
        CAPTURE(linear);
        // The two pieces of the curve differ by up to 1e-7 where they meet.
        CHECK(linearFromDisplay(displayFromLinear(linear)) == Approx(linear).epsilon(1e-5));
        CHECK(displayFromLinear(-linear) == -displayFromLinear(linear));
    }
}

TEST_CASE("displayed: shows RGB channels or the colour map of a scalar image", "[picture]") {
    Image image = filledImage(2, 1, {"Z", "B", "R", "G", "A"});
    image.pixels = {9, 3, 1, 2, 0, 8, 6, 4, 5, 1};
    const Image seen = displayed(image);
    CHECK(seen.channels == std::vector<std::string>{"R", "G", "B"});
    CHECK(seen.pixels == std::vector<float>{1, 2, 3, 4, 5, 6});

    const Image scalar = filledImage(2, 2, {"speed"}, 0.5f);
    CHECK(displayed(scalar, {.lower = 0, .upper = 2}).pixels == colorize(scalar, {.lower = 0, .upper = 2}).pixels);
    CHECK_FALSE(rgbChannels(scalar));
    CHECK_THROWS_WITH(displayed(filledImage(1, 1, {"R", "G"})), Catch::ContainsSubstring("R, G"));
    CHECK_THROWS_AS(displayed(Image{}), ValueError);
}

TEST_CASE("displayed: vector components map to red and green and blue around the middle of the scale", "[picture]") {
    Image vectors = filledImage(2, 1, {"velocity.x", "velocity.y", "velocity.z"});
    vectors.pixels = {-2, 0, 2, 1, 5, -9};
    CHECK(isVector(vectors));
    const Image seen = displayed(vectors, {.map = ColorMap::diverging, .lower = -2, .upper = 2});
    CHECK(seen.channels == std::vector<std::string>{"R", "G", "B"});
    CHECK(seen.pixels == std::vector<float>{0, 0.5f, 1, 0.75f, 1, 0});
    CHECK_FALSE(isVector(filledImage(1, 1, {"a.x", "b.y", "a.z"})));
    CHECK_FALSE(isVector(filledImage(1, 1, {"R", "G", "B"})));
    CHECK_FALSE(isVector(filledImage(1, 1, {"a.x", "a.y"})));
}
