#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Bound.h"
#include "curlew/field/NoiseField.h"
#include "curlew/math/Fade.h"
#include "support/FiniteDifference.h"
#include "support/Formula.h"

#include <limits>

using namespace curlew;
using namespace curlew::test;

namespace {

constexpr double kWidth = 0.25;
const ScalarField kNoise = noiseField<Psrd3>({.seed = 4}, {.frequency = 1.5});

Wall sphereWall(Side side) { return {.sdf = sphereSdf(1), .side = side, .width = kWidth}; }

bool flows(Side side, double d) { return side == Side::both || (side == Side::inside) == (d < 0); }

/// The noise as `bounded` uses it: scaled to its amplitude, shifted by an eighth more than that.
ScalarField target(const ScalarField& noise, double amplitude, double sign, bool separate) {
    return (amplitude / noise.range().bound()) * noise + constantField(separate ? sign * 1.125 * amplitude : 0);
}

} // namespace

TEST_CASE("Eq. 13: value and the three terms of the gradient", "[field]") {
    const Side side = GENERATE(Side::inside, Side::outside, Side::both);
    const bool separate = GENERATE(true, false);
    const double amplitude = GENERATE(-1.0, 0.4);
    CAPTURE(static_cast<int>(side), separate, amplitude);
    const Wall wall = sphereWall(side);
    const ScalarField g = bounded(kNoise, wall, {.separate = separate, .amplitude = amplitude});
    size_t layer = 0, beyond = 0, still = 0;
    for (const Vec3d& p : randomPoints(cube(1.5), 10000, 1)) {
        const auto d = wall.sdf.distance.at<1>(p);
        const auto jet = g.at<1>(p);
        CAPTURE(p, d.value);
        if (!flows(side, d.value)) { // the distance itself
            ++still;
            if (jet.value != d.value || jet.gradient != d.gradient) FAIL("not the distance on the side without flow");
            continue;
        }
        const double sign = d.value < 0 ? -1 : 1;
        const auto n = target(kNoise, amplitude < 0 ? kWidth : amplitude, sign, separate).at<1>(p);
        const auto alpha = quinticFade(std::abs(d.value) / kWidth);
        const double value = (1 - alpha.value) * d.value + alpha.value * n.value;
        const Vec3d gradient = d.gradient * (1 - alpha.value) + n.gradient * alpha.value +
                               d.gradient * ((n.value - d.value) * alpha.first * sign / kWidth);
        // A dozen roundings of terms below 10.
        if (!(std::abs(jet.value - value) < 1e-14)) FAIL("value " << jet.value << " for " << value);
        if (!(length(jet.gradient - gradient) < 1e-13)) FAIL("gradient off by " << length(jet.gradient - gradient));
        ++(std::abs(d.value) < kWidth ? layer : beyond);
    }
    CHECK(layer > 500);
    CHECK(beyond > 500);
    CHECK((still > 500) == (side != Side::both));
}

TEST_CASE("beyond the width only the noise is left, at the wall only the distance", "[field]") {
    const Side side = GENERATE(Side::inside, Side::outside, Side::both);
    const Wall wall = sphereWall(side);
    const ScalarField g = bounded(kNoise, wall);
    const ScalarField plane =
        bounded(kNoise, {.sdf = planeSdf({{0, 0, 1}}, 0), .side = side, .width = kWidth}); // exact zeros
    for (uint64_t k = 0; k < 1000; ++k) {
        const Vec3d p = randomPoint(cube(2), 2, k);
        const double d = wall.sdf.distance.at<0>(p).value;
        CAPTURE(p, d);
        if (flows(side, d) && std::abs(d) > kWidth) {
            const auto n = target(kNoise, kWidth, d < 0 ? -1 : 1, true).at<2>(p);
            REQUIRE(difference(g.at<2>(p), n) < 1e-13);
        }
        // On the wall g = d and ∇g = ∇d.
        const Vec3d foot{{p[0], p[1], 0}};
        const auto jet = plane.at<1>(foot);
        REQUIRE(jet.value == 0);
        REQUIRE(jet.gradient == Vec3d{{0, 0, 1}});
        const Vec3d onSphere = p * (1 / length(p));
        const auto near = g.at<1>(onSphere), distance = wall.sdf.distance.at<1>(onSphere);
        // d is a rounding of 1 there, and α of third order in it.
        REQUIRE(std::abs(near.value - distance.value) < 1e-30);
        REQUIRE(length(near.gradient - distance.gradient) < 1e-28);
    }
}

TEST_CASE("separated, the result has the sign of the distance everywhere", "[field]") {
    const Side side = GENERATE(Side::inside, Side::outside, Side::both);
    const double amplitude = GENERATE(-1.0, 0.0, 0.01, 5.0);
    const bool torus = GENERATE(true, false);
    CAPTURE(static_cast<int>(side), amplitude, torus);
    Wall wall = sphereWall(side);
    if (torus) wall.sdf = torusSdf(1, 0.4);
    const ScalarField g = bounded(kNoise, wall, {.separate = true, .amplitude = amplitude});
    const ScalarField plain = bounded(kNoise, wall, {.separate = false, .amplitude = amplitude});
    size_t wrong = 0;
    for (const Vec3d& p : randomPoints(cube(1.6), 30000, 3)) {
        const double d = wall.sdf.distance.at<0>(p).value, value = g.at<0>(p).value;
        CAPTURE(p, d, value);
        if (!(value * d > 0)) FAIL("sign");
        const auto single = g.at<0, float>(p).value;
        if (!(double(single) * d > 0) && std::abs(d) > 1e-6) FAIL("sign in float");
        wrong += plain.at<0>(p).value * d < 0;
    }
    CHECK(wrong > 0); // it takes the shift
}

TEST_CASE("the derivatives of a bounded noise are those of its value", "[field]") {
    const Side side = GENERATE(Side::inside, Side::outside, Side::both);
    const bool separate = GENERATE(true, false);
    CAPTURE(static_cast<int>(side), separate);
    const ScalarField g = bounded(kNoise, sphereWall(side), {.separate = separate});
    std::vector<Vec3d> points;
    for (const Vec3d& p : randomPoints(cube(1.2), 4000, 4)) {
        const double d = length(p) - 1;
        // In the layer and around it; the distance beyond is tested with the shapes.
        if (flows(side, d) && std::abs(d) < 1.2 * kWidth) points.push_back(p);
    }
    REQUIRE(points.size() > 500);
    // Third derivatives: α''' <= 60 / width³ = 3840 times (noise - d) <= 3/4, and lower ones of α (α'' <= 93, α'
    // <= 7.5) with those of the noise (gradient <= 2.2, Hessian <= 25, third <= 500).
    requireDerivatives(g, points, 0x1p-12, 3840 * 0.75 + 3 * 93 * 2.2 + 3 * 7.5 * 25 + 500);
}

TEST_CASE("a bounded noise is C² at the wall and at the end of the layer", "[field]") {
    const Side side = GENERATE(Side::inside, Side::outside, Side::both);
    const double depth = GENERATE(0.0, kWidth, -kWidth);
    CAPTURE(static_cast<int>(side), depth);
    const ScalarField g = bounded(kNoise, sphereWall(side));
    constexpr double kStep = 0x1p-30;
    Worst value, gradient, hessian;
    for (uint64_t k = 0; k < 1000; ++k) {
        const Vec3d p = randomPoint(cube(1), 5, k), n = p * (1 / length(p));
        const auto below = g.at<2>(n * (1 - depth - kStep)), above = g.at<2>(n * (1 - depth + kStep));
        value.see(difference(below, above, 0, 1), n);
        gradient.see(difference(below, above, 1, 4), n);
        hessian.see(difference(below, above, 4, 10), n);
    }
    // 2 kStep times the next derivative: below 10, 200 and 5000, see above.
    CHECK(value.value < 2 * kStep * 10);
    CHECK(gradient.value < 2 * kStep * 200);
    CHECK(hessian.value < 2 * kStep * 5000);
}

TEST_CASE("unusable walls are errors that say what to do", "[field]") {
    const Wall good = sphereWall(Side::inside);
    for (const double bad : {0.0, -0.1, std::nan(""), std::numeric_limits<double>::infinity()}) {
        Wall wall = good;
        wall.width = bad;
        CAPTURE(bad);
        CHECK_THROWS_AS(bounded(kNoise, wall), ValueError);
    }
    const ScalarField ramp = rampField({{1, 0, 0}});
    CHECK_THROWS_AS(bounded(ramp, good), ValueError);
    CHECK_THROWS_WITH(bounded(ramp, good), Catch::Contains("separate=0"));
    // Without a range an unbounded field is taken as it is.
    const ScalarField g = bounded(ramp, good, {.separate = false});
    CHECK(g.at<0>({{0.3, 0, 0}}).value == Approx(0.3));
    CHECK(std::isinf(g.range().bound()));
}

namespace {

/// The same in the plane.
WallN<2> disc(Side side) { return {.sdf = sphereSdf<2>(1), .side = side, .width = kWidth}; }

} // namespace

TEST_CASE("a noise whose range is not about zero is centred before it is separated", "[field]") {
    const Side side = GENERATE(Side::inside, Side::outside, Side::both);
    const double amplitude = GENERATE(-1.0, 0.0, 0.7);
    const auto noise = noiseField<ValueNoise<2>>({.seed = 3}, {.frequency = 2, .amplitude = 3}); // within 0 … 3
    REQUIRE(noise.range() == Range{0, 3});
    const double size = amplitude < 0 ? kWidth : amplitude == 0 ? 1.5 : amplitude;
    const WallN<2> wall = disc(side);
    const auto g = bounded(noise, wall, {.separate = true, .amplitude = amplitude});
    const auto plain = bounded(noise, wall, {.separate = false, .amplitude = amplitude});
    double least = 1e300, most = 0;
    size_t beyond = 0;
    for (const auto& p : randomPoints(cube<2>(2), 5000, 10)) {
        const double d = wall.sdf.distance.at<0>(p).value, value = g.at<0>(p).value;
        CAPTURE(static_cast<int>(side), amplitude, p, d, value);
        if (!(value * d > 0)) FAIL("sign");
        if (!flows(side, d) || std::abs(d) < kWidth) continue;
        ++beyond;
        const double centred = (noise.at<0>(p).value - 1.5) / 1.5 * size, sign = d < 0 ? -1 : 1;
        if (!(std::abs(value - (centred + sign * 1.125 * size)) < 1e-14)) FAIL("not the noise, centred and shifted");
        if (!(std::abs(plain.at<0>(p).value - centred) < 1e-14)) FAIL("not the noise, centred");
        least = std::min(least, std::abs(value));
        most = std::max(most, std::abs(value));
    }
    CHECK(beyond > 500);
    // From an eighth of its size to twice its size and an eighth.
    CHECK(least >= 0.125 * size - 1e-15);
    CHECK(most <= 2.125 * size + 1e-15);
    CHECK(most > 1.5 * size);
}

TEST_CASE("in two dimensions a bounded noise has the derivatives of its value", "[field]") {
    const Side side = GENERATE(Side::inside, Side::outside, Side::both);
    const bool separate = GENERATE(true, false);
    CAPTURE(static_cast<int>(side), separate);
    std::vector<Vec<double, 2>> points;
    for (const auto& p : randomPoints(cube<2>(1.3), 3000, 11)) {
        const double d = length(p) - 1;
        if (flows(side, d) && std::abs(d) < 1.2 * kWidth) points.push_back(p);
    }
    REQUIRE(points.size() > 300);
    const auto g = bounded(waves<2>(1), disc(side), {.separate = separate, .amplitude = 0.5});
    // As in 3D: noise - d <= 5/4 with derivatives of at most 1 + 0.5 · 2, 2 + 0.5 · 4 and 7 + 0.5 · 8.
    requireDerivatives(g, points, 0x1p-12, 3840 * 1.25 + 3 * 93 * 2 * 2 + 3 * 7.5 * 4 + 11);
    // The third derivative jumps at both ends of the layer.
    requireThirdDerivatives(g, points, 0x1p-12, 0.02);
    // On the wall it is the distance.
    for (uint64_t k = 0; k < 100; ++k) {
        const Vec<double, 2> p = randomPoint(cube<2>(1), 12, k), n = p * (1 / length(p));
        CAPTURE(n);
        REQUIRE(std::abs(g.at<0>(n).value) <= 0x1p-52);
        REQUIRE(length(g.at<1>(n).gradient - n) <= 1e-14);
    }
}

TEST_CASE("a bounded noise in five dimensions has its sign", "[field]") {
    const WallN<5> wall{.sdf = sphereSdf<5>(1), .side = Side::both, .width = kWidth};
    const auto g = bounded(noiseField<SimplexNoise<5>>(), wall);
    for (const auto& p : randomPoints(cube<5>(0.8), 1000, 13)) {
        const double d = wall.sdf.distance.at<0>(p).value;
        CAPTURE(p, d);
        if (!(g.at<0>(p).value * d > 0)) FAIL("sign");
    }
    requireDerivatives(bounded(waves<5>(1), wall), randomPoints(cube<5>(0.8), 200, 14), 0x1p-12, 6000);
}

TEMPLATE_TEST_CASE_SIG("a product with a clipped distance is zero on the wall and has exact derivatives", "[field]",
                       ((int N), N), 2, 3) {
    constexpr double kRange = 0.4;
    const auto noise = waves<N>(2);
    const SdfN<N> ball = sphereSdf<N>(1);
    const auto g = productBounded(noise, ball, kRange);
    for (uint64_t k = 0; k < 300; ++k) {
        const Vec<double, N> p = randomPoint(cube<N>(1), 15, k), n = p * (1 / length(p));
        const auto jet = g.template at<1>(n);
        CAPTURE(N, n);
        // A rounding of 1 off the wall; there its gradient is noise grad d.
        REQUIRE(std::abs(jet.value) <= 4 * 0x1p-53);
        REQUIRE(length(jet.gradient - n * noise.template at<0>(n).value) <= 1e-14);
        // Beyond the range only a multiple of the noise is left.
        const auto far = g.template at<2>(n * 1.5), there = noise.template at<2>(n * 1.5);
        REQUIRE(difference(far, there * (kRange / 2)) <= 1e-15);
        const auto deep = g.template at<2>(n * 0.5);
        REQUIRE(difference(deep, noise.template at<2>(n * 0.5) * (-kRange / 2)) <= 1e-15);
    }
    CHECK(g.range() == Range::within(kRange / 2));
    std::vector<Vec<double, N>> points;
    for (const auto& p : randomPoints(cube<N>(1.3), 2000, 16))
        if (std::abs(length(p) - 1) < 0.45) points.push_back(p);
    REQUIRE(points.size() > 300);
    // The clip's derivatives over its range: 1, 1.875/r, 5.8/r²; those of the distance, at 0.55 from its centre: 1, 1.9
    // and 10; those of the noise 2, 4, 8.
    const double c2 = 1.875 / kRange, c3 = 5.8 / (kRange * kRange);
    const double clip2 = c2 + 1.9, clip3 = c3 + 3 * c2 * 1.9 + 10;
    requireDerivatives(g, points, 0x1p-9, clip3 + 3 * clip2 * 2 + 3 * 4 + 8 * kRange / 2);
    requireThirdDerivatives(g, points, 0x1p-11, 0.02); // its fourth derivatives jump at the ends of the range
    for (const double bad : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
        CAPTURE(bad);
        CHECK_THROWS_AS(productBounded(noise, ball, bad), ValueError);
    }
}

TEST_CASE("whether a bounded field has third derivatives does not depend on the place", "[field]") {
    const auto moved = displaced(waves<2>(1), waves<2>(2), 0.1);
    for (const Side side : {Side::inside, Side::outside, Side::both}) {
        const auto g = bounded(moved, disc(side));
        CAPTURE(static_cast<int>(side));
        CHECK_THROWS_AS(g.at<3>({{0.5, 0}}), ValueError);
        CHECK_THROWS_AS(g.at<3>({{2, 0}}), ValueError);
        CHECK_NOTHROW(g.at<2>({{0.5, 0}}));
        CHECK_NOTHROW(bounded(waves<2>(1), disc(side)).at<3>({{2, 0}}));
    }
}

TEST_CASE("an amplitude that is not finite is an error", "[field]") {
    for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
        CAPTURE(bad);
        CHECK_THROWS_AS(bounded(kNoise, sphereWall(Side::inside), {.amplitude = bad}), ValueError);
    }
    CHECK_THROWS_AS(bounded(constantField(1), sphereWall(Side::inside)), ValueError); // nothing to scale
}
