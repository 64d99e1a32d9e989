// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/NoiseField.h"
#include "curlew/flow/FlowScale.h"
#include "support/Catch.h"
#include "support/Formula.h"

#include <cmath>
#include <numbers>

using namespace curlew;

namespace {

Flow noiseFlow(double frequency, int octaves) {
    const OctaveOptions sum{.frequency = frequency, .octaves = octaves};
    return {noiseField<Psrd3>({.seed = 1}, sum),
            noiseField<Psrd3>({.seed = 2}, sum),
            {.box = Box{}.padded(4 / frequency), .wall = {}}};
}

} // namespace

TEST_CASE("wavelengthOf: scales with the flow and not with its speed and is shorter with octaves", "[flow]") {
    const double one = wavelengthOf(noiseFlow(1, 1));
    CHECK(one > 0.4); // of the product of two gradients that vary over one cell each
    CHECK(one < 1.2);
    CHECK(wavelengthOf(noiseFlow(1000, 1)) == Approx(one / 1000).epsilon(1e-9));
    CHECK(wavelengthOf(withSpeed(noiseFlow(1, 1), 17)) == Approx(one).epsilon(1e-9));
    CHECK(wavelengthOf(noiseFlow(1, 3)) < 0.6 * one);
    CHECK(wavelengthOf(noiseFlow(1, 1).within({.box = Box{{{0, 0, 0}}, {{HUGE_VAL, 1, 1}}}, .wall = {}})) == 0);
}

TEST_CASE("wavelengthOf: a plane wave has its wavelength", "[flow]") {
    // f = sin(k x), g = z: the velocity is (0, -k cos(k x), 0).
    const ScalarField f = test::formula([](const auto& x) { return sin(x[0] * 7); });
    const ScalarField g = test::formula([](const auto& x) { return x[2]; });
    const double wave = wavelengthOf(Flow(f, g, {.box = Box{}.padded(20), .wall = {}}));
    CHECK(wave == Approx(2 * std::numbers::pi / 7).epsilon(0.03)); // from 8192 random positions
}
