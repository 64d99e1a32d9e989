// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "support/FiniteDifference.h"
#include "support/Formula.h"

#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

/// Returns v rotated by `degrees` about a coordinate axis (Rodrigues' formula).
Vec3d turned(const Vec3d& v, int axis, double degrees) {
    const double angle = degrees * std::numbers::pi / 180;
    const Vec3d k = unit(axis);
    return v * std::cos(angle) + cross(k, v) * std::sin(angle) + k * (dot(k, v) * (1 - std::cos(angle)));
}

Vec3d put(const Vec3d& p, const Placement& placement) {
    Vec3d q = p;
    for (int axis = 0; axis < 3; ++axis) q[axis] *= placement.scale[axis];
    for (int axis = 0; axis < 3; ++axis) q = turned(q, axis, placement.rotate[axis]);
    return q + placement.offset;
}

const ScalarField kF = sinesF(), kG = sinesG();

} // namespace

TEST_CASE("constantField and rampField: values and derivatives are exact", "[field]") {
    const ScalarField constant = constantField(-2.5), ramp = rampField({{1, -2, 0.5}}, 3);
    for (const Vec3d& p : randomPoints(cube(10), 100, 1)) {
        CAPTURE(p);
        REQUIRE(difference(constant.at<2>(p), Jet<double, 3, 2>(-2.5)) == 0);
        const auto jet = ramp.at<2>(p);
        REQUIRE(std::abs(jet.value - (p[0] - 2 * p[1] + 0.5 * p[2] + 3)) < 40 * 0x1p-52); // a few roundings of 38
        REQUIRE(jet.gradient == Vec3d{{1, -2, 0.5}});
        for (const double h : jet.hessian.c) REQUIRE(h == 0);
    }
    CHECK(constant.range().maxAbs() == 2.5);
    CHECK(std::isinf(ramp.range().maxAbs()));
}

TEST_CASE("field algebra: sum and product and multiple evaluate as operations on jets", "[field]") {
    for (const Vec3d& p : randomPoints(cube(2), 300, 2)) {
        const auto f = kF.at<2>(p), g = kG.at<2>(p);
        CAPTURE(p);
        REQUIRE(difference((kF + kG).at<2>(p), f + g) == 0);
        REQUIRE(difference((-1.5 * kF).at<2>(p), f * -1.5) == 0);
        const auto product = (kF * kG).at<2>(p);
        REQUIRE(product.value == f.value * g.value);
        // The product rule, written out. The tolerance is a few roundings of terms of at most 100.
        for (int i = 0; i < 3; ++i) {
            REQUIRE(std::abs(product.gradient[i] - (f.value * g.gradient[i] + g.value * f.gradient[i])) < 1e-13);
            for (int j = 0; j < 3; ++j)
                REQUIRE(std::abs(product.hessian(i, j) -
                                 (f.value * g.hessian(i, j) + g.value * f.hessian(i, j) +
                                  f.gradient[i] * g.gradient[j] + g.gradient[i] * f.gradient[j])) < 1e-13);
        }
    }
}

TEST_CASE("field algebra: derivatives agree with central differences", "[field]") {
    const auto points = randomPoints(cube(1), 300, 3);
    // Third derivatives are at most 100 for each field, and 8 times 3 · 100 for products of two.
    SECTION("sum") { requireDerivatives(kF + kG, points, 1e-3, 200); }
    SECTION("product") { requireDerivatives(kF * kG, points, 1e-3, 2400); }
    SECTION("multiple") { requireDerivatives(-2.0 * kG, points, 1e-3, 200); }
    SECTION("product with a ramp") { requireDerivatives(kF * rampField({{1, 2, 3}}, 1), points, 1e-3, 2400); }
    SECTION("placed") {
        // Scaling by at least 1/2 multiplies third derivatives by at most 8, and the rotation by sqrt 3 cubed.
        requireDerivatives(
            placed(kG, {.offset = {{0.4, -1, 2}}, .rotate = {{20, -35, 110}}, .scale = {{2, 0.5, -1.5}}}), points, 1e-3,
            5000);
    }
}

TEST_CASE("field algebra: ranges of sums and products and multiples hold", "[field]") {
    const ScalarField n = noiseField<Psrd3>({.seed = 1}), m = noiseField<Psrd3>({.seed = 2}, {.amplitude = 3});
    struct Case {
        ScalarField field;
        double expected;
    };
    constexpr double kBound = Psrd3::kBound;
    for (const auto& [field, expected] :
         {Case{n + m, 4 * kBound}, Case{n * m, 3 * kBound * kBound}, Case{-2.0 * n, 2 * kBound},
          Case{placed(m, {.offset = {{1, 2, 3}}, .rotate = {}, .scale = {{3, 1, 1}}}), 3 * kBound}}) {
        CHECK(std::abs(field.range().maxAbs() - expected) < 1e-14);
        for (const Vec3d& p : randomPoints(cube(10), 10000, 4))
            if (!(std::abs(field.at<0>(p).value) <= field.range().maxAbs())) FAIL("beyond its bound at " << p[0]);
    }
    CHECK(std::isinf((n + rampField({{1, 0, 0}})).range().maxAbs()));
    // Zero times a field is zero, for any range of the field.
    CHECK((constantField(0) * rampField({{1, 0, 0}})).range().maxAbs() == 0);
    CHECK((0.0 * rampField({{1, 0, 0}})).range().maxAbs() == 0);
}

TEST_CASE("placed: the field has at R S p + offset its value at p", "[field]") {
    const Placement placement = GENERATE(
        Placement{.offset = {{1, 2, 3}}}, Placement{.rotate = {{30, 0, 0}}}, Placement{.rotate = {{0, 30, 0}}},
        Placement{.rotate = {{0, 0, 30}}}, Placement{.rotate = {{40, -70, 130}}}, Placement{.scale = {{2, 0.5, 3}}},
        Placement{.offset = {{0.4, -1, 2}}, .rotate = {{20, -35, 110}}, .scale = {{2, 0.5, -1.5}}});
    CAPTURE(placement.offset, placement.rotate, placement.scale);
    const ScalarField field = placed(kG, placement);
    for (const Vec3d& p : randomPoints(cube(2), 300, 5)) {
        CAPTURE(p);
        // |∇g| < 8 times the roundings of a position of at most 10.
        REQUIRE(std::abs(field.at<0>(put(p, placement)).value - kG.at<0>(p).value) < 8 * 10 * 10 * 0x1p-53);
    }
    // A case by hand: the x axis rotated by 90 degrees about z is the y axis.
    const ScalarField x = placed(rampField({{1, 0, 0}}), {.offset = {{0, 5, 0}}, .rotate = {{0, 0, 90}}});
    CHECK(x.at<0>({{3, 7, 1}}).value == Approx(2).margin(1e-14));
    CHECK(length(x.at<1>({{3, 7, 1}}).gradient - Vec3d{{0, 1, 0}}) < 1e-15);
}

TEST_CASE("placed: the default placement changes nothing and a scale of zero is an error", "[field]") {
    const ScalarField same = placed(kF, {});
    CHECK(same.at<0>({{0.1, 0.2, 0.3}}).value == kF.at<0>({{0.1, 0.2, 0.3}}).value);
    for (int axis = 0; axis < 3; ++axis) {
        Placement flat;
        flat.scale[axis] = 0;
        CHECK_THROWS_AS(placed(kF, flat), ValueError);
    }
}

namespace {

template <int N>
struct Operands {
    ScalarFieldN<N> a = waves<N>(1), b = waves<N>(2), positive = b + constantField<N>(3);
};

/// Returns a linear function that varies along a direction other than an axis, in N dimensions.
template <int N>
ScalarFieldN<N> ramp(double offset) {
    Vec<double, N> direction;
    for (int i = 0; i < N; ++i) direction[i] = i % 2 ? -0.8 : 0.6;
    return rampField<N>(direction, offset);
}

} // namespace

TEMPLATE_TEST_CASE_SIG("field algebra: evaluates as operations on jets in every dimension", "[field]", ((int N), N), 1,
                       2, 5) {
    const Operands<N> f;
    for (const auto& p : randomPoints(cube<N>(3), 100, 20)) {
        const auto a = f.a.template at<3>(p), b = f.b.template at<3>(p), positive = f.positive.template at<3>(p);
        CAPTURE(N, p);
        REQUIRE(difference((f.a + f.b).template at<3>(p), a + b) == 0);
        REQUIRE(difference((f.a - f.b).template at<3>(p), a - b) == 0);
        REQUIRE(difference((f.a * f.b).template at<3>(p), a * b) == 0);
        REQUIRE(difference((-1.5 * f.a).template at<3>(p), a * -1.5) == 0);
        // a / b times b is a, up to a few roundings of terms below 100.
        const auto quotient = (f.a / f.positive).template at<3>(p);
        REQUIRE(difference(quotient * positive, a) <= 1e-13);
        REQUIRE(std::abs(quotient.value - a.value / positive.value) <= 0x1p-52);
        REQUIRE(difference((f.positive / f.positive).template at<3>(p), Jet<double, N, 3>(1.0)) <= 1e-13);
        REQUIRE((f.a - f.a).template at<2>(p).value == 0);
        const auto single = (f.a / f.positive).template at<1, float>(p);
        REQUIRE(std::abs(double(single.value) - quotient.value) <= 1e-6); // waves in float are accurate to 5e-7
    }
}

TEMPLATE_TEST_CASE_SIG("field algebra: derivatives agree with central differences in every dimension", "[field]",
                       ((int N), N), 1, 2, 5) {
    const Operands<N> f;
    const auto points = randomPoints(cube<N>(3), N == 5 ? 150 : 300, 21);
    constexpr double kStep = 0x1p-9;
    SECTION("difference") {
        requireDerivatives(f.a - f.b, points, kStep, 16);
        requireThirdDerivatives(f.a - f.b, points, kStep);
    }
    SECTION("quotient") {
        // Derivatives of 1/(b + 3), by order: at most 1/2, 1/2, 2 and 11.
        requireDerivatives(f.a / f.positive, points, kStep, 8 * 0.5 + 3 * 4 * 0.5 + 3 * 2 * 2 + 11);
        requireThirdDerivatives(f.a / f.positive, points, kStep);
    }
    SECTION("smooth minimum and maximum") {
        // The cubic over k = 1/2, with a gap whose derivatives are at most 4, 8 and 16: 16 + 3 · 2 · 4 · 8 + 4 · 4³.
        // Its third derivative jumps on three surfaces.
        for (const auto& field : {smoothMin(f.a, f.b, 0.5), smoothMax(f.a, f.b, 0.5)}) {
            requireDerivatives(field, points, kStep, 16 + 192 + 256);
            requireThirdDerivatives(field, points, kStep, 0.05);
        }
    }
    SECTION("clipped") {
        // Derivatives of the clip of size 1/2: 1, 3.75 and 23.1. Its fourth derivative jumps.
        requireDerivatives(clipped(f.a, 0.5), points, kStep, 8 + 3 * 3.75 * 2 * 4 + 23.1 * 8);
        requireThirdDerivatives(clipped(f.a, 0.8), points, kStep, 0.05);
    }
}

TEST_CASE("quotient: a divisor that may be zero is refused", "[field]") {
    const ScalarField n = noiseField<Psrd3>();
    CHECK_THROWS_AS(n / n, ValueError);
    CHECK_THROWS_AS(n / rampField({{1, 0, 0}}), ValueError); // unknown range
    CHECK_THROWS_AS(n / constantField(0), ValueError);
    CHECK_THROWS_AS(n / noiseField<ValueNoise<3>>(), ValueError); // zero is the end of its range
    CHECK_THROWS_AS(n / (n + constantField(Psrd3::kBound)), ValueError);
    CHECK_THROWS_WITH(n / n, Catch::ContainsSubstring("-1.044") && Catch::ContainsSubstring("add a constant"));
    CHECK_NOTHROW(n / (n + constantField(1.05)));
    CHECK_NOTHROW(n / (n - constantField(1.05)));
    CHECK((rampField({{8, 0, 0}}) / constantField(-2)).at<0>({{1, 0, 0}}).value == -4);
}

TEMPLATE_TEST_CASE_SIG("smoothMin and smoothMax: equal min and max except at a rounded corner", "[field]", ((int N), N),
                       1, 2, 5) {
    const Operands<N> f;
    const double smoothing = GENERATE(0.0, 1e-3, 0.5, 10.0);
    const auto low = smoothMin(f.a, f.b, smoothing), high = smoothMax(f.a, f.b, smoothing);
    const auto swapped = smoothMin(f.b, f.a, smoothing);
    size_t apart = 0, rounded = 0;
    for (const auto& p : randomPoints(cube<N>(3), 2000, 22)) {
        const auto a = f.a.template at<2>(p), b = f.b.template at<2>(p);
        const auto minimum = low.template at<2>(p), maximum = high.template at<2>(p);
        const double gap = std::abs(a.value - b.value);
        CAPTURE(N, smoothing, p, a.value, b.value);
        if (gap >= smoothing) {
            ++apart;
            if (difference(minimum, a.value < b.value ? a : b) != 0) FAIL("not the minimum");
            if (difference(maximum, a.value < b.value ? b : a) != 0) FAIL("not the maximum");
        } else {
            ++rounded;
            // The cubic: off by s/6 where both are equal, and by (s - gap)³ / (6 s²) elsewhere.
            const double off = std::pow(1 - gap / smoothing, 3) * smoothing / 6;
            const double rounding = 1e-14 * (1 + smoothing);
            if (!(std::abs(minimum.value - (std::min(a.value, b.value) - off)) <= rounding)) FAIL("minimum");
            if (!(std::abs(maximum.value - (std::max(a.value, b.value) + off)) <= rounding)) FAIL("maximum");
            if (!(difference(swapped.template at<2>(p), minimum) <= 1e-13 * (1 + 16 / smoothing))) FAIL("order");
            // Its gradient is a mean of both gradients, hence never longer, so distances remain lower bounds.
            for (int i = 0; i < N; ++i) {
                const auto [least, most] = std::minmax(a.gradient[i], b.gradient[i]);
                if (!(minimum.gradient[i] >= least - 1e-12 && minimum.gradient[i] <= most + 1e-12)) FAIL("gradient");
            }
        }
    }
    CHECK((smoothing == 10 ? rounded : apart) > 100);
    CHECK((smoothing != 0.5 || rounded > 500));
}

TEMPLATE_TEST_CASE_SIG("smoothMin is C² and clipped is C³ across their seams", "[field]", ((int N), N), 1, 2, 5) {
    const Operands<N> f;
    constexpr double kStep = 0x1p-30, k = 0.5;
    const auto gap = f.a - f.b;
    for (const double seam : {-k, 0.0, k})
        for (const auto& field : {smoothMin(f.a, f.b, k), smoothMax(f.a, f.b, k)}) {
            const auto jumps = jumpsAcross(field, gap - constantField<N>(seam), cube<N>(20), kStep, 23);
            CAPTURE(N, seam, jumps.seen, jumps.largest[3]);
            CHECK(jumps.seen > 15);
            // First, second and third derivatives, see above, plus their roundings.
            CHECK(jumps.largest[0] <= 2 * kStep * 2 + 1e-15);
            CHECK(jumps.largest[1] <= 2 * kStep * (4 + 2 * 16) + 1e-14);
            CHECK(jumps.largest[2] <= 2 * kStep * 464 + 1e-13);
        }
    constexpr double range = 0.25;
    for (const double seam : {-range, 0.0, range}) {
        const auto jumps = jumpsAcross(clipped(f.a, range), f.a - constantField<N>(seam), cube<N>(20), kStep, 24);
        CAPTURE(N, seam, jumps.seen);
        CHECK(jumps.seen > 15);
        // Derivatives of the clip are at most 1, 7.5, 92.4 and 3840 by order, those of the waves 2, 4, 8 and 16.
        CHECK(jumps.largest[0] <= 2 * kStep * 2 + 1e-15);
        CHECK(jumps.largest[1] <= 2 * kStep * (4 + 7.5 * 4) + 1e-14);
        CHECK(jumps.largest[2] <= 2 * kStep * (8 + 3 * 7.5 * 8 + 92.4 * 8) + 1e-13);
        CHECK(jumps.largest[3] <= 2 * kStep * (16 + 7.5 * 112 + 6 * 92.4 * 16 + 3840 * 16) + 1e-12);
    }
}

TEMPLATE_TEST_CASE_SIG("clipped: keeps small values and levels off at half its range", "[field]", ((int N), N), 1, 2,
                       5) {
    const double range = GENERATE(0.3, 2.0);
    const auto field = clipped(ramp<N>(0.1), range);
    double last = -1e9;
    Vec<double, N> p;
    for (int k = -400; k <= 400; ++k) { // along the x axis, where the field has the slope 0.6
        p[0] = k / 400.0 * 3 * range;
        const auto jet = field.template at<3>(p);
        const double x = 0.6 * p[0] + 0.1, t = std::min(std::abs(x) / range, 1.0);
        const double sign = x < 0 ? -1 : 1;
        CAPTURE(N, range, x);
        // The integral of 1 - fade.
        const double expected = sign * range * (t - std::pow(t, 6) + 3 * std::pow(t, 5) - 2.5 * std::pow(t, 4));
        REQUIRE(std::abs(jet.value - expected) <= 1e-14);
        REQUIRE(jet.value >= last);
        if (t == 1) {
            REQUIRE(jet.value == sign * range / 2);
            REQUIRE(difference(jet, Jet<double, N, 3>(jet.value)) == 0);
        }
        last = jet.value;
    }
    // Near zero it equals the field up to 2.5 |x|⁴ / range³.
    for (const double x : {1e-3, -1e-4}) {
        p[0] = (x - 0.1) / 0.6;
        CHECK(std::abs(field.template at<0>(p).value - x) <= 2.6 * std::pow(x, 4) / std::pow(range, 3) + 1e-16);
    }
    CHECK(field.range() == Interval::within(range / 2));
}

TEMPLATE_TEST_CASE_SIG("field algebra: values stay within the range of the field", "[field]", ((int N), N), 1, 2, 5) {
    const auto a = waves<N>(1) + constantField<N>(0.5), b = 2.0 * waves<N>(2) - constantField<N>(3);
    const double kInfinity = std::numeric_limits<double>::infinity();
    struct Case {
        const char* name;
        ScalarFieldN<N> field;
        Interval expected;
    };
    const std::vector<Case> cases{
        {"sum", a + b, {-5.5, 0.5}},
        {"difference", a - b, {0.5, 6.5}},
        {"product", a * b, {-7.5, 2.5}},
        {"multiple", -2.0 * a, {-3, 1}},
        {"quotient", a / b, {-1.5, 0.5}},
        {"minimum", smoothMin(a, -1.0 * b, 0.6), {-0.6, 1.5}},
        {"maximum", smoothMax(a, b, 0.6), {-0.5, 1.6}},
        {"clipped", clipped(a, 0.5), {-0.25, 0.25}},
        {"product with something unbounded", a * ramp<N>(1), {-kInfinity, kInfinity}},
        {"minimum with something unbounded", smoothMin(a, ramp<N>(1), 0), {-kInfinity, 1.5}},
        {"maximum with something unbounded", smoothMax(a, ramp<N>(1), 0), {-0.5, kInfinity}},
        {"clipped, unbounded", clipped(ramp<N>(1), 4), {-2, 2}},
        {"nothing of something unbounded", constantField<N>(0) * ramp<N>(1), {0, 0}},
    };
    for (const auto& [name, field, expected] : cases) {
        const Interval range = field.range();
        CAPTURE(N, name, range.lower, range.upper);
        const auto near = [](double x, double y) { return x == y || std::abs(x - y) <= 1e-14; };
        CHECK((near(range.lower, expected.lower) && near(range.upper, expected.upper)));
        double lower = kInfinity, upper = -kInfinity;
        for (const auto& p : randomPoints(cube<N>(8), 2000, 25)) {
            const double value = field.template at<0>(p).value;
            lower = std::min(lower, value);
            upper = std::max(upper, value);
        }
        CHECK(lower >= range.lower);
        CHECK(upper <= range.upper);
    }
}

TEST_CASE("smoothMin and smoothMax and clipped: invalid arguments are errors", "[field]") {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    for (const double bad : {-0.1, kInfinity, std::nan("")}) {
        CAPTURE(bad);
        CHECK_THROWS_AS(smoothMin(kF, kG, bad), ValueError);
        CHECK_THROWS_AS(smoothMax(kF, kG, bad), ValueError);
        CHECK_THROWS_AS(clipped(kF, bad), ValueError);
    }
    CHECK_THROWS_AS(clipped(kF, 0), ValueError);
    CHECK_THROWS_WITH(smoothMin(kF, kG, -0.5), Catch::ContainsSubstring("-0.5"));
    CHECK_THROWS_WITH(clipped(kF, -2), Catch::ContainsSubstring("-2"));
}
