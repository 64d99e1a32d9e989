// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/field/Transforms.h"
#include "curlew/flow/Carried.h"
#include "curlew/flow/Flows.h"
#include "support/FiniteDifference.h"

#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

FlowN<2> swirls() { return FlowN<2>({noiseField<SineNoise<2>>({.seed = 3})}); }
Flow swirlsInSpace() { return Flow(noiseField<SineNoise<3>>({.seed = 3}), noiseField<SineNoise<3>>({.seed = 4})); }

} // namespace

TEST_CASE("carried: a uniform flow translates the field by velocity times time", "[flow]") {
    const ScalarField noise = noiseField<Psrd3>({.seed = 1});
    const Vec3d velocity{{0.5, -1, 2}};
    const ScalarField there = carried(noise, uniformFlow(velocity), {.time = 0.4, .steps = 1});
    const ScalarField moved = placed(noise, {.offset = velocity * 0.4});
    for (const Vec3d& p : randomPoints(cube(2), 200, 1)) {
        CAPTURE(p);
        // Positions are rounded differently, by some 1e-15, which is multiplied by derivatives of up to 600.
        REQUIRE(difference(there.at<2>(p), moved.at<2>(p)) < 1e-11);
        REQUIRE(difference(there.at<1, float>(p), moved.at<1, float>(p)) < 1e-4);
    }
}

TEST_CASE("carried: a rigid rotation rotates the field with fourth order in the steps", "[flow]") {
    // c = (f_y, -f_x) = w (-y, x) for f = -w (x² + y²) / 2.
    const double w = 1.5, time = 0.8;
    const auto x = rampField<2>({{1, 0}}), y = rampField<2>({{0, 1}});
    const FlowN<2> rotation({-0.5 * w * (x * x + y * y)});
    const auto noise = noiseField<SineNoise<2>>({.seed = 2});
    const auto turned = placed(noise, PlacementN<2>{.rotate = {{0, 0, w * time * 180 / std::numbers::pi}}});
    const auto off = [&](int steps) {
        const auto there = carried(noise, rotation, {.time = time, .steps = steps});
        double worst = 0;
        for (const auto& p : randomPoints(cube<2>(1), 100, 2))
            worst = std::max(worst, difference(there.at<2>(p), turned.at<2>(p)));
        return worst;
    };
    CHECK(observedOrder(off(4), off(8)) == Approx(4).margin(0.3));
    CHECK(off(64) < 1e-6);
}

TEST_CASE("carried: derivatives agree with central differences for any number of steps", "[flow]") {
    const int steps = GENERATE(1, 5);
    CAPTURE(steps);
    const CarryOptions o{.time = 0.1, .steps = steps};
    // The observed third derivatives are at most 8500: the field's own are about 300, and it is compressed to a third
    // of its wavelength.
    requireDerivatives(carried(noiseField<SineNoise<2>>({.seed = 5}), swirls(), o), randomPoints(cube<2>(1), 300, 3),
                       0x1p-10, 20000);
    requireDerivatives(carried(noiseField<SineNoise<3>>({.seed = 5}), swirlsInSpace(), o),
                       randomPoints(cube(1), 300, 4), 0x1p-10, 20000);
}

TEST_CASE("carried: forward and back returns nearly the original field", "[flow]") {
    // The way back uses the opposite flow, whose potentials are known; the third derivatives of the carried field are
    // not needed.
    const auto noise = noiseField<SineNoise<2>>({.seed = 6});
    const auto forth = carried(noise, swirls(), {.time = 0.3, .steps = 20});
    const auto back = carried(forth, swirls(), {.time = -0.3, .steps = 20});
    double away = 0;
    for (const auto& p : randomPoints(cube<2>(1), 100, 7)) {
        CAPTURE(p);
        REQUIRE(std::abs(back.at<0>(p).value - noise.at<0>(p).value) < 1e-4); // RK4's error: (0.015 · 10)⁴ of 0.3
        away = std::max(away, std::abs(forth.at<0>(p).value - noise.at<0>(p).value));
    }
    CHECK(away > 0.1);
}

TEST_CASE("carried: unsuitable flows and options are errors that say why", "[flow]") {
    const auto noise = noiseField<SineNoise<2>>();
    CHECK_THROWS_WITH(carried(noise, swirls().normalized(1)), Catch::ContainsSubstring("normalised"));
    CHECK_THROWS_WITH(carried(noise, swirls(), {.steps = 0}), Catch::ContainsSubstring("0 steps"));
    CHECK_THROWS_AS(carried(noise, swirls(), {.time = std::nan("")}), ValueError);
    const FlowN<2> warped({noiseField<Psrd2>({}, {.octaves = 2, .warp = 0.1})});
    CHECK_THROWS_WITH(carried(noise, warped), Catch::ContainsSubstring("third derivatives"));
    const FlowN<2> twice({carried(noise, swirls())});
    CHECK_THROWS_WITH(carried(noise, twice), Catch::ContainsSubstring("third derivatives"));
    CHECK(carried(noise, swirls()).range().maxAbs() == noise.range().maxAbs());
}
