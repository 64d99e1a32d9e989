// SPDX-License-Identifier: Apache-2.0
// Longer than 400 lines: the same measurements test the layer for each side, shape and dimension.
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Bound.h"
#include "curlew/field/NoiseField.h"
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

/// The noise as `bounded` uses it, scaled to its amplitude (if negative: to a slope of 1), and its shift.
struct Target {
    double amplitude, shift;
    ScalarField noise;

    Target(const ScalarField& plain, const Wall& wall, double wanted, bool separate)
        : amplitude(wanted < 0 ? plain.range().maxAbs() / noiseScaleOf(plain, wall.sdf.bounds).slope : wanted),
          shift(separate ? std::max(0.0, 1.125 * amplitude - wall.width / 2) : 0),
          noise((amplitude / plain.range().maxAbs()) * plain) {}
};

/// Alpha at depth s in widths, its slope, and the integral of 1 - alpha. Alpha has three parts, each a third of the
/// width: a cubic smoothstep up to the slope 3/2, that slope, and a smoothstep down to zero slope.
struct Blend {
    double alpha, slope, levelled;
    explicit Blend(double s) {
        if (s > 0.5) {
            const Blend other(std::max(0.0, 1 - s));
            *this = other;
            alpha = 1 - other.alpha;
            levelled = other.levelled - (1 - std::min(1.0, s)) + 0.5;
        } else if (s > 1.0 / 3) {
            alpha = 1.5 * s - 0.25;
            slope = 1.5;
            levelled = s - (0.75 * s * s - 0.25 * s + 0.025);
        } else {
            const double t = 3 * s;
            alpha = 0.5 * (t * t * t - t * t * t * t / 2);
            slope = 1.5 * (3 * t * t - 2 * t * t * t);
            levelled = s - (std::pow(t, 4) / 4 - std::pow(t, 5) / 10) / 6;
        }
    }
};

} // namespace

TEST_CASE("bounded: value and gradient follow Eq. 13", "[field]") {
    const Side side = GENERATE(Side::inside, Side::outside, Side::both);
    const bool separate = GENERATE(true, false);
    const double amplitude = GENERATE(-1.0, 0.4);
    CAPTURE(static_cast<int>(side), separate, amplitude);
    const Wall wall = sphereWall(side);
    const ScalarField g = bounded(kNoise, wall, {.separate = separate, .amplitude = amplitude});
    const Target target(kNoise, wall, amplitude, separate);
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
        const auto n = target.noise.at<1>(p);
        const double depth = std::abs(d.value) / kWidth, shifted = n.value + sign * target.shift;
        const Blend blend(depth);
        const double value = sign * kWidth * blend.levelled + blend.alpha * shifted;
        const Vec3d gradient = d.gradient * (1 - blend.alpha) + n.gradient * blend.alpha +
                               d.gradient * (shifted * blend.slope * sign / kWidth);
        // Tolerance: a dozen roundings of terms below 10.
        if (!(std::abs(jet.value - value) < 1e-14)) FAIL("value " << jet.value << " for " << value);
        if (!(length(jet.gradient - gradient) < 1e-13)) FAIL("gradient off by " << length(jet.gradient - gradient));
        ++(std::abs(d.value) < kWidth ? layer : beyond);
    }
    CHECK(layer > 500);
    CHECK(beyond > 500);
    CHECK((still > 500) == (side != Side::both));
}

TEST_CASE("bounded: is the noise beyond the width and the distance on the boundary", "[field]") {
    const Side side = GENERATE(Side::inside, Side::outside, Side::both);
    const Wall wall = sphereWall(side);
    const ScalarField g = bounded(kNoise, wall), target = Target(kNoise, wall, -1, false).noise;
    const ScalarField plane =
        bounded(kNoise, {.sdf = planeSdf({{0, 0, 1}}, 0), .side = side, .width = kWidth}); // exactly zero on the wall
    for (uint64_t k = 0; k < 1000; ++k) {
        const Vec3d p = randomPoint(cube(2), 2, k);
        const double d = wall.sdf.distance.at<0>(p).value;
        CAPTURE(p, d);
        if (flows(side, d) && std::abs(d) > kWidth) {
            const auto n = (target + constantField(d < 0 ? -kWidth / 2 : kWidth / 2)).at<2>(p);
            REQUIRE(difference(g.at<2>(p), n) < 1e-13);
        }
        // On the wall, g = d and ∇g = ∇d.
        const Vec3d foot{{p[0], p[1], 0}};
        const auto jet = plane.at<1>(foot);
        REQUIRE(jet.value == 0);
        REQUIRE(jet.gradient == Vec3d{{0, 0, 1}});
        const Vec3d onSphere = p * (1 / length(p));
        const auto near = g.at<1>(onSphere), distance = wall.sdf.distance.at<1>(onSphere);
        // There d is a rounding of 1, and α is of third order in it.
        REQUIRE(std::abs(near.value - distance.value) < 1e-30);
        REQUIRE(length(near.gradient - distance.gradient) < 1e-28);
    }
}

TEST_CASE("bounded: with separate=1 the result has the sign of the distance", "[field]") {
    const Side side = GENERATE(Side::inside, Side::outside, Side::both);
    const double amplitude = GENERATE(-1.0, 0.0, 0.01, 5.0);
    const bool torus = GENERATE(true, false);
    CAPTURE(static_cast<int>(side), amplitude, torus);
    Wall wall = sphereWall(side);
    if (torus) wall.sdf = torusSdf(1, 0.4);
    const ScalarField g = bounded(kNoise, wall, {.separate = true, .amplitude = amplitude});
    const ScalarField plain = bounded(kNoise, wall, {.separate = false, .amplitude = amplitude});
    size_t wrong = 0;
    for (const Vec3d& p : randomPoints(cube(1.6), 10000, 3)) {
        const double d = wall.sdf.distance.at<0>(p).value, value = g.at<0>(p).value;
        CAPTURE(p, d, value);
        if (!(value * d > 0)) FAIL("sign");
        const auto single = g.at<0, float>(p).value;
        if (!(double(single) * d > 0) && std::abs(d) > 1e-6) FAIL("sign in float");
        wrong += plain.at<0>(p).value * d < 0;
    }
    // It needs the shift, unless the noise is smaller than the integrated distance.
    CHECK((wrong > 0) == (amplitude != 0.01));
}

TEST_CASE("bounded: derivatives agree with central differences", "[field]") {
    const Side side = GENERATE(Side::inside, Side::outside, Side::both);
    const bool separate = GENERATE(true, false);
    CAPTURE(static_cast<int>(side), separate);
    const ScalarField g = bounded(kNoise, sphereWall(side), {.separate = separate});
    std::vector<Vec3d> points;
    for (const Vec3d& p : randomPoints(cube(1.2), 4000, 4)) {
        const double d = length(p) - 1;
        // In and near the layer. The shapes' own tests cover the distance elsewhere.
        if (flows(side, d) && std::abs(d) < 1.2 * kWidth) points.push_back(p);
    }
    REQUIRE(points.size() > 500);
    // Third derivatives: α''' <= 60 / width³ = 3840 times (noise - d) <= 3/4, and lower derivatives of α (α'' <= 93, α'
    // <= 7.5) with those of the noise (gradient <= 2.2, Hessian <= 25, third <= 500).
    requireDerivatives(g, points, 0x1p-12, 3840 * 0.75 + 3 * 93 * 2.2 + 3 * 7.5 * 25 + 500);
}

TEST_CASE("bounded: is C² on the boundary and at the end of the layer", "[field]") {
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

TEST_CASE("bounded: invalid walls and options are errors that say what to do", "[field]") {
    const Wall good = sphereWall(Side::inside);
    for (const double bad : {0.0, -0.1, std::nan(""), std::numeric_limits<double>::infinity()}) {
        Wall wall = good;
        wall.width = bad;
        CAPTURE(bad);
        CHECK_THROWS_AS(bounded(kNoise, wall), ValueError);
    }
    for (const double bad : {-0.1, 1.0, 2.0, std::nan("")}) {
        CAPTURE(bad);
        CHECK_THROWS_WITH(bounded(kNoise, good, {.variation = bad}), Catch::ContainsSubstring("variation"));
    }
    // Some options require a range, which a ramp does not have.
    const ScalarField ramp = rampField({{2, 0, 0}});
    CHECK_THROWS_WITH(bounded(ramp, good, {.separate = true}), Catch::ContainsSubstring("separate=1"));
    CHECK_THROWS_WITH(bounded(ramp, good, {.amplitude = 0.4}), Catch::ContainsSubstring("amplitude="));
    CHECK_THROWS_WITH(bounded(ramp, good, {.variation = 0.4}), Catch::ContainsSubstring("variation="));
    // By default only its slope is needed.
    const ScalarField g = bounded(ramp, good);
    CHECK(g.at<0>({{0.3, 0, 0}}).value == Approx(0.3 - kWidth / 2));
    CHECK(std::isinf(g.range().maxAbs()));
}

namespace {

/// The same wall in 2D.
WallN<2> disc(Side side) { return {.sdf = sphereSdf<2>(1), .side = side, .width = kWidth}; }

} // namespace

TEST_CASE("bounded: noise is centred to zero before it is separated", "[field]") {
    const Side side = GENERATE(Side::inside, Side::outside, Side::both);
    const double amplitude = GENERATE(-1.0, 0.0, 0.7);
    const auto noise = noiseField<ValueNoise<2>>({.seed = 3}, {.frequency = 2, .amplitude = 3}); // within 0 … 3
    REQUIRE(noise.range() == Interval{0, 3});
    const WallN<2> wall = disc(side);
    const double size = amplitude < 0    ? 1.5 / noiseScaleOf(noise, wall.sdf.bounds).slope
                        : amplitude == 0 ? 1.5
                                         : amplitude;
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
        if (!(std::abs(plain.at<0>(p).value - centred - sign * kWidth / 2) < 1e-14)) FAIL("not the noise, centred");
        least = std::min(least, std::abs(value));
        most = std::max(most, std::abs(value));
    }
    CHECK(beyond > 500);
    // From 1/8 of its size to 2 + 1/8 times its size.
    CHECK(least >= 0.125 * size - 1e-15);
    CHECK(most <= 2.125 * size + 1e-15);
    CHECK(most > 1.5 * size);
}

TEST_CASE("bounded: derivatives agree with central differences in 2D", "[field]") {
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
    // As in 3D: noise - d <= 5/4, with derivatives of at most 1 + 0.5 · 2, 2 + 0.5 · 4 and 7 + 0.5 · 8.
    requireDerivatives(g, points, 0x1p-12, 3840 * 1.25 + 3 * 93 * 2 * 2 + 3 * 7.5 * 4 + 11);
    // The third derivative jumps where the thirds of the layer end.
    requireThirdDerivatives(g, points, 0x1p-12, 0.04);
    // On the wall it equals the distance.
    for (uint64_t k = 0; k < 100; ++k) {
        const Vec<double, 2> p = randomPoint(cube<2>(1), 12, k), n = p * (1 / length(p));
        CAPTURE(n);
        REQUIRE(std::abs(g.at<0>(n).value) <=
                0x1p-51); // a rounding of the distance, divided and multiplied by the width
        REQUIRE(length(g.at<1>(n).gradient - n) <= 1e-14);
    }
}

TEST_CASE("bounded: with separate=1 has the sign of the distance in 5D", "[field]") {
    const WallN<5> wall{.sdf = sphereSdf<5>(1), .side = Side::both, .width = kWidth};
    const auto g = bounded(noiseField<SimplexNoise<5>>(), wall, {.separate = true});
    for (const auto& p : randomPoints(cube<5>(0.8), 1000, 13)) {
        const double d = wall.sdf.distance.at<0>(p).value;
        CAPTURE(p, d);
        if (!(g.at<0>(p).value * d > 0)) FAIL("sign");
    }
    requireDerivatives(bounded(waves<5>(1), wall), randomPoints(cube<5>(0.8), 1000, 14), 0x1p-12, 6000);
}

TEMPLATE_TEST_CASE_SIG("productBounded: is zero on the boundary and has exact derivatives", "[field]", ((int N), N), 2,
                       3) {
    constexpr double kRange = 0.4;
    const auto noise = waves<N>(2);
    const SdfN<N> ball = sphereSdf<N>(1);
    const auto g = productBounded(noise, ball, kRange);
    for (uint64_t k = 0; k < 300; ++k) {
        const Vec<double, N> p = randomPoint(cube<N>(1), 15, k), n = p * (1 / length(p));
        const auto jet = g.template at<1>(n);
        CAPTURE(N, n);
        // The value is a rounding of 1. The gradient on the wall is the noise times grad d.
        REQUIRE(std::abs(jet.value) <= 4 * 0x1p-53);
        REQUIRE(length(jet.gradient - n * noise.template at<0>(n).value) <= 1e-14);
        // Outside the range, a multiple of the noise remains.
        const auto far = g.template at<2>(n * 1.5), there = noise.template at<2>(n * 1.5);
        REQUIRE(difference(far, there * (kRange / 2)) <= 1e-15);
        const auto deep = g.template at<2>(n * 0.5);
        REQUIRE(difference(deep, noise.template at<2>(n * 0.5) * (-kRange / 2)) <= 1e-15);
    }
    CHECK(g.range() == Interval::within(kRange / 2));
    std::vector<Vec<double, N>> points;
    for (const auto& p : randomPoints(cube<N>(1.3), 2000, 16))
        if (std::abs(length(p) - 1) < 0.45) points.push_back(p);
    REQUIRE(points.size() > 300);
    // Derivatives of the clip over its range r: 1, 1.875/r, 5.8/r². Those of the distance, at 0.55 from its centre: 1,
    // 1.9 and 10. Those of the noise: 2, 4, 8.
    const double c2 = 1.875 / kRange, c3 = 5.8 / (kRange * kRange);
    const double clip2 = c2 + 1.9, clip3 = c3 + 3 * c2 * 1.9 + 10;
    requireDerivatives(g, points, 0x1p-9, clip3 + 3 * clip2 * 2 + 3 * 4 + 8 * kRange / 2);
    requireThirdDerivatives(g, points, 0x1p-11, 0.02); // its fourth derivatives jump at the ends of the range
    for (const double bad : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
        CAPTURE(bad);
        CHECK_THROWS_AS(productBounded(noise, ball, bad), ValueError);
    }
}

TEST_CASE("bounded: availability of third derivatives does not depend on position", "[field]") {
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

TEST_CASE("bounded: a non-finite amplitude or a constant noise is an error", "[field]") {
    for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
        CAPTURE(bad);
        CHECK_THROWS_AS(bounded(kNoise, sphereWall(Side::inside), {.amplitude = bad}), ValueError);
    }
    CHECK_THROWS_AS(bounded(constantField(1), sphereWall(Side::inside)), ValueError); // a zero slope cannot be scaled
}

TEST_CASE("bounded: the noise is scaled to the slope of the distance", "[field]") {
    const double frequency = GENERATE(0.7, 3.0);
    const int octaves = GENERATE(1, 3);
    CAPTURE(frequency, octaves);
    const auto noise = noiseField<Psrd3>({.seed = 5}, {.frequency = frequency, .octaves = octaves, .amplitude = 7});
    const Wall wall{.sdf = planeSdf({{0, 0, 1}}, 0), .side = Side::both, .width = 0.1};
    const ScalarField g = bounded(noise, wall);
    double sum = 0;
    constexpr size_t kCount = 20000;
    for (uint64_t k = 0; k < kCount; ++k) {
        const Vec3d p = randomPoint(cube(20 / frequency), 17, k) + Vec3d{{0, 0, 30 / frequency}}; // outside the layer
        const auto jet = g.at<1>(p);
        sum += dot(jet.gradient, jet.gradient);
    }
    // Both means are over thousands of nearly independent slopes, whose squares scatter by about their mean.
    CHECK(std::sqrt(sum / kCount) == Approx(1).epsilon(0.04));
}

TEST_CASE("bounded: in wide layers the slope at every depth is close to that beyond the layer", "[field]") {
    const double relative = GENERATE(0.2, 0.3, 0.45, 0.6);
    const int octaves = GENERATE(1, 2);
    const Side side = GENERATE(Side::inside, Side::outside);
    CAPTURE(relative, octaves, static_cast<int>(side));
    constexpr int kBins = 5;
    std::array<double, kBins> sum{}, count{};
    for (uint64_t seed = 0; seed < 8; ++seed) {
        const auto noise = noiseField<Psrd3>({.seed = seed}, {.octaves = octaves});
        const Wall wall{.sdf = planeSdf({{0, 0, 1}}, 0), .side = side, .width = relative};
        const ScalarField g = bounded(noise, wall);
        for (uint64_t k = 0; k < 4000; ++k) {
            Vec3d p = randomPoint(cube(10), seed, k);
            p[2] = (side == Side::inside ? -1 : 1) * relative * (p[2] + 10) / 20;
            const auto bin = static_cast<size_t>(std::min(kBins - 1.0, std::abs(p[2]) / relative * kBins));
            const auto jet = g.at<1>(p);
            sum[bin] += dot(jet.gradient, jet.gradient);
            count[bin] += 1;
        }
    }
    // (1 - α)² + α² + α'² σ² for a noise with slope 1 and σ = 0.14 wavelengths (less for two octaves): from 0.76² to
    // 1.3² for these widths, and at most 1.06² for those above 0.3; plus the random deviation of 8 noises.
    for (size_t k = 0; k < kBins; ++k) {
        CAPTURE(k);
        CHECK(std::sqrt(sum[k] / count[k]) < (relative < 0.3 ? 1.35 : 1.12));
        CHECK(std::sqrt(sum[k] / count[k]) > (relative > 0.3 ? 0.72 : 0.82));
    }
}

TEST_CASE("bounded: variation changes the slope along the boundary and keeps the zero set", "[field]") {
    const auto noise = noiseField<Psrd2>({.seed = 2}, {.frequency = 2});
    const double variation = 0.9;
    const WallN<2> wall = disc(GENERATE(Side::inside, Side::both));
    const auto g = bounded(noise, wall, {.separate = true, .variation = variation});
    Interval seen{1e300, -1e300};
    for (uint64_t k = 0; k < 2000; ++k) {
        const Vec<double, 2> p = randomPoint(cube<2>(1), 18, k), n = p * (1 / length(p));
        const auto jet = g.at<1>(n);
        CAPTURE(n);
        REQUIRE(std::abs(jet.value) < 1e-15);
        // The gradient is along the normal: 1 + variation times the noise, divided by its bound.
        const double slope = dot(jet.gradient, n);
        REQUIRE(length(jet.gradient - n * slope) < 1e-13);
        REQUIRE(slope == Approx(1 + variation * noise.at<0>(n).value / noise.range().maxAbs()));
        seen = {std::min(seen.lower, slope), std::max(seen.upper, slope)};
        const Vec<double, 2> inside = p * 0.95;
        const double d = wall.sdf.distance.at<0>(inside).value;
        REQUIRE(g.at<0>(inside).value * d > 0);
    }
    CHECK(seen.lower < 0.6);
    CHECK(seen.upper > 1.4);
    std::vector<Vec<double, 2>> points;
    for (const auto& p : randomPoints(cube<2>(1.2), 2000, 19))
        if (std::abs(length(p) - 1) < 1.2 * kWidth && length(p) < 1) points.push_back(p);
    REQUIRE(points.size() > 300);
    requireDerivatives(g, points, 0x1p-12, 3840 + 3 * 93 * 8 + 3 * 7.5 * 60 + 1500);
}

TEST_CASE("layerRamp: is Bridson's odd ramp with value 1 beyond the layer and exact derivatives", "[field]") {
    const Side side = GENERATE(Side::inside, Side::outside, Side::both);
    const ScalarField ramp = layerRamp(sphereWall(side));
    const double sign = side == Side::outside ? 1 : -1;
    CHECK(ramp.at<0>({{0, 0, 1}}).value == 0);
    CHECK(ramp.at<0>({{0, 0, 0.5}}).value == -sign);
    CHECK(ramp.at<0>({{0, 0, 1.5}}).value == sign);
    CHECK(ramp.at<1>({{0, 0, 1}}).gradient[2] == Approx(sign * 1.875 / kWidth));
    // r = 1/2: 15/16 - 10/64 + 3/256.
    CHECK(ramp.at<0>({{0, 0, 1 + kWidth / 2}}).value == Approx(sign * (0.9375 - 0.15625 + 0.01171875)));
    std::vector<Vec3d> points;
    for (const Vec3d& p : randomPoints(cube(1.3), 4000, 20))
        if (std::abs(length(p) - 1) < 1.2 * kWidth) points.push_back(p);
    // Third derivatives of up to 15 / width³, plus those of the distance.
    requireDerivatives(ramp, points, 0x1p-12, 15 / (kWidth * kWidth * kWidth) + 600);
    requireThirdDerivatives(ramp, points, 0x1p-12, 0.05); // the third derivative jumps at the ends of the layer
}

TEST_CASE("layerWidth: is 0.3 wavelengths unless the object limits it", "[field]") {
    const Box box{{{-1, -2, -3}}, {{1, 2, 3}}};
    const auto noise = [](double frequency) { return noiseField<Psrd3>({}, {.frequency = frequency, .octaves = 3}); };
    const LayerWidth fine = layerWidth(noise(4), box);
    CHECK(fine.width == Approx(0.3 / 4));
    CHECK_FALSE(fine.limited);
    CHECK_FALSE(fine.noise.measured);
    const LayerWidth coarse = layerWidth(noise(0.1), box);
    CHECK(coarse.limited);
    CHECK(coarse.width == 0.5);                                                        // a quarter of 2
    CHECK(layerWidth(noise(0.1), box, Side::outside).width == 1.5);                    // a quarter of 6
    CHECK(layerWidth(noise(0.1), planeSdf({{0, 0, 1}}, 0).bounds).width == Approx(3)); // no limit
    CHECK_THROWS_AS(layerWidth(constantField(1), box), ValueError);
}
