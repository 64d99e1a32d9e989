// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Formula.h"
#include "curlew/field/NoiseField.h"
#include "curlew/field/NoiseScale.h"
#include "curlew/field/Transforms.h"
#include "support/Catch.h"
#include "support/Points.h"

#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

const Box kBox{{{-1, -1, -1}}, {{1, 1, 1}}};
const ScalarField kNoise = noiseField<Psrd3>({.seed = 3}, {.frequency = 2, .octaves = 3});

} // namespace

TEST_CASE("ScalarField: wavelength is that of the lowest octave in the expression", "[field]") {
    CHECK(kNoise.wavelength() == 0.5);
    CHECK(noiseField<Psrd3>({}, {.frequency = 4, .octaves = 3, .lacunarity = 0.5}).wavelength() == 1);
    CHECK(noiseField<Psrd3>({}, {.frequency = 2, .octaves = 3, .warp = 0.1}).wavelength() == 0.5);
    const ScalarField lower = noiseField<ValueNoise<3>>({}, {.frequency = 0.25});
    CHECK((kNoise + lower).wavelength() == 4);
    CHECK((constantField(2) * kNoise).wavelength() == 0.5);
    CHECK(smoothMin(kNoise, lower, 0.1).wavelength() == 4);
    CHECK(displaced(kNoise, lower, 0.1).wavelength() == 0.5);
    CHECK(placed(kNoise, {.rotate = {{10, 20, 30}}, .scale = {{3, 3, 3}}}).wavelength() == Approx(1.5));
    CHECK(placed(kNoise, {.scale = {{1, 1, 8}}}).wavelength() == Approx(1)); // the geometric mean
    CHECK(projected(noiseField<Psrd2>({}, {.frequency = 5}), Matrix<2, 3>{}).wavelength() == Approx(0.2));
    CHECK(rampField(Vec3d{{1, 0, 0}}).wavelength() == 0);
    CHECK(constantField(1).wavelength() == 0);
}

TEST_CASE("ScalarField: noises, ramps, their sums and their affine maps are homogeneous", "[field]") {
    const ScalarField ramp = rampField(Vec3d{{1, 0, 0}});
    CHECK(kNoise.homogeneous());
    CHECK((kNoise - 2.0 * ramp).homogeneous());
    CHECK(placed(kNoise, {.rotate = {{10, 20, 30}}, .scale = {{1, 1, 8}}}).homogeneous());
    CHECK_FALSE(noiseField<Psrd3>({}, {.octaves = 2, .warp = 0.1}).homogeneous());
    CHECK_FALSE(noiseField<Psrd3>({}, {.billow = 0.1}).homogeneous());
    CHECK_FALSE(smoothMin(kNoise, ramp, 0).homogeneous());
    CHECK_FALSE((kNoise * ramp).homogeneous());
    CHECK_FALSE(displaced(kNoise, kNoise, 0.1).homogeneous());
    CHECK_FALSE((kNoise + smoothMin(kNoise, ramp, 0)).homogeneous());
}

TEST_CASE("noiseScaleOf: the slope is the rms gradient for any box", "[field]") {
    double sum = 0;
    constexpr uint64_t kCount = 50000;
    for (uint64_t k = 0; k < kCount; ++k) {
        const auto gradient = kNoise.at<1>(randomPoint(cube(50), 1, k)).gradient;
        sum += dot(gradient, gradient);
    }
    const double slope = std::sqrt(sum / kCount);
    for (const double half : {0.01, 1.0, 30.0}) {
        CAPTURE(half);
        const NoiseScale scale = noiseScaleOf(kNoise, Box{}.padded(half));
        CHECK(scale.slope == Approx(slope).epsilon(0.03)); // from some thousand independent squares
        CHECK(scale.wavelength == 0.5);
        CHECK_FALSE(scale.measured);
    }
    CHECK(noiseScaleOf(3.0 * kNoise, kBox).slope == Approx(3 * noiseScaleOf(kNoise, kBox).slope));
}

TEST_CASE("noiseScaleOf: measures the wavelength of a field that does not state one", "[field]") {
    // sin k x has the standard deviation sqrt(1/2) and the slope k sqrt(1/2).
    const double k = 11;
    const auto wave = formulaField([=](const auto& x, const auto& c) { return sin(x[0] * c(k)) + c(7); });
    const NoiseScale scale = noiseScaleOf(wave, kBox);
    CHECK(scale.measured);
    CHECK(scale.slope == Approx(k * std::numbers::sqrt2 / 2).epsilon(0.03));
    CHECK(scale.wavelength == Approx(7 / k).epsilon(0.05));
    // The same rule for psrdnoise agrees with its known wavelength within 5 %.
    const ScalarField psrd = noiseField<Psrd3>({}, {.frequency = 3});
    const double deviation = [&] {
        double squares = 0;
        for (uint64_t i = 0; i < 20000; ++i) {
            const double value = psrd.at<0>(randomPoint(cube(10), 2, i)).value;
            squares += value * value;
        }
        return std::sqrt(squares / 20000);
    }();
    CHECK(7 * deviation / noiseScaleOf(psrd, kBox).slope == Approx(1.0 / 3).epsilon(0.05));
}

TEST_CASE("noiseScaleOf: a field without a finite slope is an error", "[field]") {
    CHECK_THROWS_AS(noiseScaleOf(constantField(3), kBox), ValueError);
    const auto broken = formulaField([](const auto& x, const auto& c) { return x[0] * c(std::nan("")); });
    CHECK_THROWS_AS(noiseScaleOf(broken, kBox), ValueError);
}
