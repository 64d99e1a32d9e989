#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "support/FiniteDifference.h"
#include "support/Formula.h"

#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

/// v turned by `degrees` about a coordinate axis (Rodrigues).
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

TEST_CASE("constants and ramps are exact", "[field]") {
    const ScalarField constant = constantField(-2.5), ramp = rampField({{1, -2, 0.5}}, 3);
    for (const Vec3d& p : randomPoints(cube(10), 100, 1)) {
        CAPTURE(p);
        REQUIRE(difference(constant.at<2>(p), Jet<double, 3, 2>(-2.5)) == 0);
        const auto jet = ramp.at<2>(p);
        REQUIRE(std::abs(jet.value - (p[0] - 2 * p[1] + 0.5 * p[2] + 3)) < 40 * 0x1p-52); // some roundings of 38
        REQUIRE(jet.gradient == Vec3d{{1, -2, 0.5}});
        for (const double h : jet.hessian.c) REQUIRE(h == 0);
    }
    CHECK(constant.range().bound() == 2.5);
    CHECK(std::isinf(ramp.range().bound()));
}

TEST_CASE("sum, product and multiple of fields are those of their jets", "[field]") {
    for (const Vec3d& p : randomPoints(cube(2), 300, 2)) {
        const auto f = kF.at<2>(p), g = kG.at<2>(p);
        CAPTURE(p);
        REQUIRE(difference((kF + kG).at<2>(p), f + g) == 0);
        REQUIRE(difference((-1.5 * kF).at<2>(p), f * -1.5) == 0);
        const auto product = (kF * kG).at<2>(p);
        REQUIRE(product.value == f.value * g.value);
        // The Leibniz rule once more, written out; a few roundings of terms of at most 100.
        for (int i = 0; i < 3; ++i) {
            REQUIRE(std::abs(product.gradient[i] - (f.value * g.gradient[i] + g.value * f.gradient[i])) < 1e-13);
            for (int j = 0; j < 3; ++j)
                REQUIRE(std::abs(product.hessian(i, j) -
                                 (f.value * g.hessian(i, j) + g.value * f.hessian(i, j) +
                                  f.gradient[i] * g.gradient[j] + g.gradient[i] * f.gradient[j])) < 1e-13);
        }
    }
}

TEST_CASE("the derivatives of field algebra agree with central differences", "[field]") {
    const auto points = randomPoints(cube(1), 300, 3);
    // Third derivatives: at most 100 for each field alone, of products of two 8 times 3 · 100.
    SECTION("sum") { requireDerivatives(kF + kG, points, 1e-3, 200); }
    SECTION("product") { requireDerivatives(kF * kG, points, 1e-3, 2400); }
    SECTION("multiple") { requireDerivatives(-2.0 * kG, points, 1e-3, 200); }
    SECTION("product with a ramp") { requireDerivatives(kF * rampField({{1, 2, 3}}, 1), points, 1e-3, 2400); }
    SECTION("placed") {
        // Scaling by at least 1/2 makes third derivatives at most 8 times as large, times sqrt 3 cubed for the turn.
        requireDerivatives(
            placed(kG, {.offset = {{0.4, -1, 2}}, .rotate = {{20, -35, 110}}, .scale = {{2, 0.5, -1.5}}}), points, 1e-3,
            5000);
    }
}

TEST_CASE("bounds of sums, products and multiples hold", "[field]") {
    const ScalarField n = noiseField<Psrd3>({.seed = 1}), m = noiseField<Psrd3>({.seed = 2}, {.amplitude = 3});
    struct Case {
        ScalarField field;
        double expected;
    };
    constexpr double kBound = Psrd3::kBound;
    for (const auto& [field, expected] :
         {Case{n + m, 4 * kBound}, Case{n * m, 3 * kBound * kBound}, Case{-2.0 * n, 2 * kBound},
          Case{placed(m, {.offset = {{1, 2, 3}}, .rotate = {}, .scale = {{3, 1, 1}}}), 3 * kBound}}) {
        CHECK(std::abs(field.range().bound() - expected) < 1e-14);
        for (const Vec3d& p : randomPoints(cube(10), 10000, 4))
            if (!(std::abs(field.at<0>(p).value) <= field.range().bound())) FAIL("beyond its bound at " << p[0]);
    }
    CHECK(std::isinf((n + rampField({{1, 0, 0}})).range().bound()));
    // Zero times anything is zero, whatever its range.
    CHECK((constantField(0) * rampField({{1, 0, 0}})).range().bound() == 0);
    CHECK((0.0 * rampField({{1, 0, 0}})).range().bound() == 0);
}

TEST_CASE("a placed field has at R S p + offset its value at p", "[field]") {
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
    // By hand: the x axis turned by 90 degrees about z is the y axis, so y there is x here.
    const ScalarField x = placed(rampField({{1, 0, 0}}), {.offset = {{0, 5, 0}}, .rotate = {{0, 0, 90}}});
    CHECK(x.at<0>({{3, 7, 1}}).value == Approx(2).margin(1e-14));
    CHECK(length(x.at<1>({{3, 7, 1}}).gradient - Vec3d{{0, 1, 0}}) < 1e-15);
}

TEST_CASE("a field placed where it is stays itself, a scale of zero is an error", "[field]") {
    const ScalarField same = placed(kF, {});
    CHECK(same.at<0>({{0.1, 0.2, 0.3}}).value == kF.at<0>({{0.1, 0.2, 0.3}}).value);
    for (int axis = 0; axis < 3; ++axis) {
        Placement flat;
        flat.scale[axis] = 0;
        CHECK_THROWS_AS(placed(kF, flat), ValueError);
    }
}
