// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Random.h"
#include "curlew/picture/Display.h"
#include "curlew/picture/Exposure.h"
#include "support/Catch.h"

#include <cmath>

using namespace curlew;

namespace {

Image lightOf(int width, int height) { return filledImage(width, height, {"R", "G", "B"}); }

double energyOf(const Image& image) {
    double sum = 0;
    for (const float value : image.pixels) sum += static_cast<double>(value);
    return sum;
}

} // namespace

TEST_CASE("automaticExposure: considers lit pixels only", "[picture]") {
    Image light = lightOf(100, 100);
    CHECK(automaticExposure(light) == 1);
    for (int k = 0; k < 100; ++k) light.at(k, 3, 1) = 0.02f * static_cast<float>(k + 1);
    CHECK(automaticExposure(light) == Approx(1 / 1.9).epsilon(0.02));
    for (float& value : light.pixels) value *= 8;
    CHECK(automaticExposure(light) == Approx(1 / 15.2).epsilon(0.02));
}

TEST_CASE("withGlow: spreads light and conserves its sum", "[picture]") {
    Image light = lightOf(300, 200);
    light.at(150, 100, 0) = 100;
    light.at(140, 90, 2) = 50;
    const Image glowing = withGlow(light, 0.4);
    CHECK(energyOf(glowing) == Approx(150).epsilon(1e-4));
    CHECK(glowing.at(150, 100, 0) == Approx(60).epsilon(0.05));
    CHECK(glowing.at(155, 100, 0) > glowing.at(160, 100, 0));
    CHECK(glowing.at(155, 100, 0) == Approx(glowing.at(145, 100, 0)).epsilon(1e-3));
    CHECK(glowing.at(150, 105, 0) == Approx(glowing.at(155, 100, 0)).epsilon(1e-3));
    CHECK(withGlow(light, 0).pixels == light.pixels);
    CHECK_THROWS_AS(withGlow(light, 1.1), ValueError);
}

TEST_CASE("developed: never clips and brightens with the amount of light and keeps the order of channels",
          "[picture]") {
    float before = 0;
    for (const float amount : {0.01f, 0.1f, 0.5f, 1.0f, 2.0f, 4.0f, 8.0f}) {
        Image light = lightOf(1, 1);
        light.at(0, 0, 0) = amount;
        light.at(0, 0, 1) = 0.3f * amount;
        const Image shown = developed(light, 1, lightOf(1, 1));
        CHECK(shown.at(0, 0, 0) > before);
        CHECK(shown.at(0, 0, 0) < 1);
        CHECK(shown.at(0, 0, 1) < shown.at(0, 0, 0));
        CHECK(shown.at(0, 0, 2) < shown.at(0, 0, 1));
        before = shown.at(0, 0, 0);
    }
    // Faint light is mapped linearly.
    Image light = lightOf(1, 1);
    light.at(0, 0, 1) = 0.001f;
    CHECK(linearFromDisplay(static_cast<double>(developed(light, 10, lightOf(1, 1)).at(0, 0, 1))) ==
          Approx(0.01).epsilon(0.01));
}

TEST_CASE("developed: adds light to a picture and leaves its other channels unchanged", "[picture]") {
    Image ground = filledImage(2, 1, {"R", "G", "B", "A", "Z"}, 0.5f);
    Image light = lightOf(2, 1);
    light.at(1, 0, 0) = 1;
    const Image picture = developed(light, 1, ground);
    CHECK(picture.channels == ground.channels);
    for (int channel = 0; channel < 5; ++channel) CHECK(picture.at(0, 0, channel) == 0.5f);
    CHECK(picture.at(1, 0, 0) > 0.7f);
    CHECK(picture.at(1, 0, 0) < 1);
    CHECK(picture.at(1, 0, 4) == 0.5f);
    CHECK_THROWS_AS(developed(lightOf(3, 1), 1, ground), ValueError);
    CHECK_THROWS_AS(developed(light, 0, ground), ValueError);
    CHECK_THROWS_AS(developed(filledImage(2, 1, {"v"}), 1, ground), ValueError);
    CHECK_THROWS_AS(developed(light, 1, filledImage(2, 1, {"v"})), ValueError);
}
