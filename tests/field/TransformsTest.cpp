// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Random.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Bound.h"
#include "curlew/field/Transforms.h"
#include "support/FiniteDifference.h"
#include "support/Formula.h"

#include <limits>
#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

constexpr double kStep = 0x1p-9;

/// A smooth function of any number of variables without symmetries. Observed third derivatives are at most 14 for seven
/// variables.
struct Mixed {
    template <class J, int N, class K>
    J operator()(const Vec<J, N>& x, const K& k) const {
        J sum = sin(x[0] * k(1.3) + k(0.2));
        for (int i = 1; i < N; ++i) sum += cos(x[i] * k(1 + 0.2 * i) - x[i - 1] * k(0.7)) * sin(x[0] + x[i]);
        return sum;
    }
};
/// Two graphs over N variables: Hill and Bowl.
struct Hill {
    template <class J, int N, class K>
    J operator()(const Vec<J, N>& x, const K& k) const {
        return sin(x[0] + x[N - 1] * k(0.5)) * k(0.6) + x[N - 1] * x[0] * k(0.3);
    }
};
struct Bowl {
    template <class J, int N, class K>
    J operator()(const Vec<J, N>& x, const K& k) const {
        return dot(x, x) * k(0.25) - cos(x[0]) * k(0.4);
    }
};

/// The same as lifted(), differentiated by the product rule: Mixed at (x, Hill(x), Bowl(x)).
template <int N, int M>
struct Direct {
    template <class J, class K>
    J operator()(const Vec<J, N>& x, const K& k) const {
        Vec<J, M> y;
        for (int i = 0; i < N; ++i) y[i] = x[i];
        y[N] = Hill{}(x, k);
        if constexpr (M == N + 2) y[N + 1] = Bowl{}(x, k);
        return Mixed{}(y, k);
    }
};

template <int N, int M>
void checkLifted() {
    std::array<ScalarFieldN<N>, size_t{M - N}> graph = [] {
        if constexpr (M == N + 1)
            return std::array{formula<N>(Hill{})};
        else
            return std::array{formula<N>(Hill{}), formula<N>(Bowl{})};
    }();
    const auto field = lifted<N>(formula<M>(Mixed{}), graph), direct = formula<N>(Direct<N, M>{});
    const auto points = randomPoints(cube<N>(1), 100, 1);
    WorstN<N> worst, worstFloat;
    for (const auto& p : points) {
        worst.see(difference(field.template at<3>(p), direct.template at<3>(p)), p);
        worstFloat.see(difference(field.template at<1, float>(p), direct.template at<1, float>(p)), p);
    }
    CAPTURE(N, M, worst.where);
    CHECK(worst.value <= 1e-12);     // about a hundred roundings of terms below 50
    CHECK(worstFloat.value <= 1e-4); // the same in float
    // Observed third derivatives are at most 92.
    requireDerivatives(field, points, kStep, 300);
    requireThirdDerivatives(field, points, kStep);
}

template <int N, int M>
void checkSlice() {
    const auto field = formula<M>(Mixed{});
    std::array<ScalarFieldN<N>, size_t{M - N}> graph = [] {
        if constexpr (M == N + 1)
            return std::array{constantField<N>(0.4)};
        else
            return std::array{constantField<N>(0.4), constantField<N>(-1.1)};
    }();
    const auto slice = lifted<N>(field, graph);
    for (const auto& p : randomPoints(cube<N>(1), 50, 2)) {
        Vec<double, M> q;
        for (int i = 0; i < N; ++i) q[i] = p[i];
        q[N] = 0.4;
        if constexpr (M == N + 2) q[N + 1] = -1.1;
        const auto here = slice.template at<3>(p);
        const auto there = field.template at<3>(q);
        CAPTURE(N, M, p);
        REQUIRE(here.value == there.value);
        for (int i = 0; i < N; ++i) {
            REQUIRE(here.gradient[i] == there.gradient[i]);
            for (int j = i; j < N; ++j) {
                REQUIRE(here.hessian(i, j) == there.hessian(i, j));
                for (int k = j; k < N; ++k) REQUIRE(here.third(i, j, k) == there.third(i, j, k));
            }
        }
    }
}

template <int M, int N>
void checkProjected() {
    const auto field = formula<M>(Mixed{});
    Matrix<M, N> A;
    for (uint64_t i = 0; i < M; ++i) A.rows[i] = randomPoint(cube<N>(1), 3, i);
    const auto moved = projected(field, A);
    const auto points = randomPoints(cube<N>(1), 100, 4);
    for (const auto& p : points) {
        CAPTURE(M, N, p);
        REQUIRE(difference(moved.template at<3>(p), pullBack(field.template at<3>(A * p), A)) == 0);
    }
    CAPTURE(M, N);
    // Third derivatives of the field, at most 20, along vectors of length sqrt M.
    requireDerivatives(moved, points, kStep, 20 * std::pow(M, 1.5));
    requireThirdDerivatives(moved, points, kStep);
}

template <int N>
Vec<double, N> firstOf(const Vec<double, N + 1>& p) {
    return Matrix<N, N + 1>{} * p;
}

} // namespace

TEST_CASE("placed: in 2D the field has at R S p + offset its value at p", "[field]") {
    const auto field = formula<2>(Mixed{});
    const double degrees = GENERATE(0.0, 90.0, -35.0, 400.0);
    const Vec<double, 2> scale = GENERATE(Vec<double, 2>{{1, 1}}, Vec<double, 2>{{2, -0.5}});
    const PlacementN<2> placement{.offset = {{0.7, -2}}, .rotate = {{0, 0, degrees}}, .scale = scale};
    const auto moved = placed(field, placement);
    const double c = std::cos(degrees * std::numbers::pi / 180), s = std::sin(degrees * std::numbers::pi / 180);
    for (const auto& p : randomPoints(cube<2>(2), 100, 5)) {
        const double x = p[0] * scale[0], y = p[1] * scale[1];
        const Vec<double, 2> q{{c * x - s * y + 0.7, s * x + c * y - 2}};
        CAPTURE(degrees, scale, p);
        // Roundings of positions of at most 10, times a slope of at most 5.
        REQUIRE(std::abs(moved.at<0>(q).value - field.at<0>(p).value) <= 5 * 10 * 10 * 0x1p-53);
    }
    // Third derivatives of at most 20, times 2³ where the scale is 1/2.
    requireDerivatives(moved, randomPoints(cube<2>(2), 200, 6), kStep, 20 * 8 * 3);
    CHECK(placed(waves<2>(1), placement).range() == Interval::within(1));
}

TEST_CASE("placed: in 5D the field is moved and scaled along each axis", "[field]") {
    const auto field = formula<5>(Mixed{});
    const PlacementN<5> placement{.offset = {{1, -2, 0.5, 0, 3}}, .scale = {{2, 0.5, -1, 1, 4}}};
    const auto moved = placed(field, placement);
    for (const auto& p : randomPoints(cube<5>(2), 100, 7)) {
        Vec<double, 5> q = placement.offset;
        for (int i = 0; i < 5; ++i) q[i] += p[i] * placement.scale[i];
        const auto here = moved.at<1>(q), there = field.at<1>(p);
        CAPTURE(p);
        REQUIRE(std::abs(here.value - there.value) <= 10 * 20 * 10 * 0x1p-53);
        for (int i = 0; i < 5; ++i)
            REQUIRE(std::abs(here.gradient[i] * placement.scale[i] - there.gradient[i]) <= 20 * 20 * 10 * 0x1p-53);
    }
    CHECK(difference(placed(field, PlacementN<5>{}).at<2>({}), field.at<2>({})) == 0);
}

TEST_CASE("placed: a box contains what was in it, mirrored and rotated", "[field]") {
    const Box box{{{-0.2, 1, -3}}, {{0.7, 1.5, -2}}};
    const Placement mirrored{.offset = {{0.1, 0.2, 0.3}}, .scale = {{-2, 0.5, 1}}};
    const Box exact = placed(box, mirrored);
    CHECK(exact.lower == Vec3d{{0.7 * -2 + 0.1, 1 * 0.5 + 0.2, -3 + 0.3}});
    CHECK(exact.upper == Vec3d{{-0.2 * -2 + 0.1, 1.5 * 0.5 + 0.2, -2 + 0.3}});
    Placement turned = mirrored;
    for (int k = 0; k < 100; ++k) {
        for (int axis = 0; axis < 3; ++axis)
            turned.rotate[axis] = 360 * randomUniform(1, static_cast<uint64_t>(k), static_cast<uint64_t>(axis));
        const Box around = placed(box, turned);
        for (int corner = 0; corner < 8; ++corner) {
            Vec3d p;
            for (int axis = 0; axis < 3; ++axis)
                p[axis] = (corner >> axis & 1 ? box.upper : box.lower)[axis] * turned.scale[axis];
            const Vec3d moved = rotationOf(turned) * p + turned.offset;
            CAPTURE(k, corner, moved);
            CHECK(around.padded(1e-12).contains(moved));
        }
        if (k > 0) CHECK(around.lower == placed(box, Placement{turned.offset, {{0, 0, 90}}, turned.scale}).lower);
    }
    const Box everywhere = Box{}.padded(HUGE_VAL);
    CHECK(placed(everywhere, turned).lower == everywhere.lower);
}

TEST_CASE("placed: rotations that a dimension lacks and zero scales are errors", "[field]") {
    const auto one = waves<1>(1);
    const auto two = waves<2>(1);
    const auto five = waves<5>(1);
    CHECK_THROWS_AS(placed(two, PlacementN<2>{.rotate = {{10, 0, 0}}}), ValueError);
    CHECK_THROWS_AS(placed(two, PlacementN<2>{.rotate = {{0, 10, 20}}}), ValueError);
    CHECK_THROWS_WITH(placed(two, PlacementN<2>{.rotate = {{0, 10, 0}}}), Catch::ContainsSubstring("0,0,degrees"));
    CHECK_THROWS_AS(placed(one, PlacementN<1>{.rotate = {{0, 0, 10}}}), ValueError);
    CHECK_THROWS_AS(placed(five, PlacementN<5>{.rotate = {{0, 0, 10}}}), ValueError);
    CHECK_THROWS_WITH(placed(five, PlacementN<5>{.rotate = {{0, 0, 10}}}), Catch::ContainsSubstring("5 dimensions"));
    CHECK_NOTHROW(placed(five, PlacementN<5>{.offset = {{1, 2, 3, 4, 5}}}));
    for (int axis = 0; axis < 5; ++axis) {
        PlacementN<5> flat;
        flat.scale[axis] = 0;
        CAPTURE(axis);
        CHECK_THROWS_AS(placed(five, flat), ValueError);
        flat.scale[axis] = -0.0;
        CHECK_THROWS_AS(placed(five, flat), ValueError);
    }
}

TEST_CASE("projected: is the field at A x", "[field]") {
    checkProjected<1, 2>();
    checkProjected<1, 3>();
    checkProjected<2, 2>();
    checkProjected<2, 3>();
    checkProjected<3, 3>();
    checkProjected<3, 4>();
    checkProjected<4, 5>();
    checkProjected<6, 7>();
}

TEST_CASE("projected: identity rows reorder or drop coordinates", "[field]") {
    const ScalarField field = formula(Mixed{});
    const Matrix3 zxy{{unit(2), unit(0), unit(1)}};
    const ScalarField swizzled = projected(field, zxy);
    const Matrix<2, 3> xz{{unit(0), unit(2)}};
    const auto plane = formula<2>(Mixed{});
    const ScalarField extruded = projected(plane, xz);
    for (const Vec3d& p : randomPoints(cube(2), 100, 8)) {
        const auto there = field.at<2>({{p[2], p[0], p[1]}}), here = swizzled.at<2>(p);
        CAPTURE(p);
        REQUIRE(here.value == there.value);
        REQUIRE(here.gradient == Vec3d{{there.gradient[1], there.gradient[2], there.gradient[0]}});
        REQUIRE(here.hessian(0, 2) == there.hessian(1, 0));
        REQUIRE(here.hessian(1, 1) == there.hessian(2, 2));
        // A field of two variables is constant along the third.
        const auto flat = plane.at<2>({{p[0], p[2]}});
        const auto wide = extruded.at<2>(p);
        REQUIRE(wide.value == flat.value);
        REQUIRE(wide.gradient == Vec3d{{flat.gradient[0], 0, flat.gradient[1]}});
        REQUIRE(wide.hessian(0, 2) == flat.hessian(0, 1));
        REQUIRE((wide.hessian(1, 1) == 0 && wide.hessian(0, 1) == 0 && wide.hessian(1, 2) == 0));
    }
    CHECK(projected(waves<2>(1), xz).range() == Interval::within(1));
}

TEST_CASE("lifted: is the field restricted to a graph", "[field]") {
    checkLifted<2, 3>();
    checkLifted<3, 4>();
    checkLifted<3, 5>();
    checkLifted<1, 2>();
    checkLifted<1, 3>();
    checkLifted<2, 4>();
    checkLifted<5, 7>();
    CHECK(lifted<2>(waves<3>(1), {formula<2>(Hill{})}).range() == Interval::within(1));
}

TEST_CASE("lifted: with a constant graph is a slice", "[field]") {
    checkSlice<2, 3>();
    checkSlice<3, 4>();
    checkSlice<3, 5>();
    checkSlice<1, 2>();
    checkSlice<6, 7>();
}

TEMPLATE_TEST_CASE_SIG("heightField: is zero on the terrain and negative below", "[field]", ((int N), N), 2, 3, 5) {
    const auto height = formula<N - 1>(Hill{});
    const auto field = heightField<N>(height);
    for (const auto& p : randomPoints(cube<N>(1), 200, 9)) {
        const auto ground = firstOf<N - 1>(p);
        const auto h = height.template at<2>(ground);
        const auto jet = field.template at<2>(p);
        CAPTURE(N, p);
        REQUIRE(jet.value == p[N - 1] - h.value);
        REQUIRE(jet.gradient[N - 1] == 1);
        for (int i = 0; i < N - 1; ++i) {
            REQUIRE(jet.gradient[i] == -h.gradient[i]);
            REQUIRE(jet.hessian(i, N - 1) == 0);
            for (int j = 0; j < N - 1; ++j) REQUIRE(jet.hessian(i, j) == -h.hessian(i, j));
        }
        auto q = p;
        q[N - 1] = h.value;
        REQUIRE(field.template at<0>(q).value == 0);
        q[N - 1] -= 0.1;
        REQUIRE(field.template at<0>(q).value < 0);
    }
    CHECK_FALSE(field.range().finite());
    requireDerivatives(field, randomPoints(cube<N>(1), 200, 10), kStep, 5); // Hill's third derivatives are below 2
}

TEMPLATE_TEST_CASE_SIG("displaced: is the field at x plus amount times the gradient", "[field]", ((int N), N), 1, 2, 3,
                       5) {
    const auto field = waves<N>(3), by = waves<N>(4);
    constexpr double kAmount = 0.2;
    const auto moved = displaced(field, by, kAmount);
    const auto points = randomPoints(cube<N>(3), N == 5 ? 100 : 300, 11);
    for (const auto& p : points) {
        const auto q = p + by.template at<1>(p).gradient * kAmount;
        CAPTURE(N, p);
        REQUIRE(moved.template at<0>(p).value == field.template at<0>(q).value);
        REQUIRE(moved.template at<2>(p).value == field.template at<0>(q).value);
        REQUIRE(std::abs(double(moved.template at<1, float>(p).value) - field.template at<0>(q).value) <= 1e-6);
        REQUIRE(difference(displaced(field, by, 0).template at<2>(p), field.template at<2>(p)) == 0);
    }
    // The map x + 0.2 grad has derivatives of at most 1.8, 1.6 and 3.2 along unit vectors.
    requireDerivatives(moved, points, kStep, 8 * std::pow(1.8, 3) + 3 * 4 * 1.8 * 1.6 + 2 * 3.2);
    CHECK(moved.range() == field.range());
}

TEST_CASE("displaced: a ramp translates and a quadratic dilates", "[field]") {
    const ScalarField field = formula(Mixed{});
    // Displacement by a ramp is a translation, by |x|²/2 a dilation.
    const ScalarField there = displaced(field, rampField({{1, -2, 3}}), 0.5);
    const ScalarField larger = displaced(field, formula([](const auto& x, auto k) { return dot(x, x) * k(0.5); }), 0.5);
    for (const Vec3d& p : randomPoints(cube(1), 100, 12)) {
        CAPTURE(p);
        REQUIRE(difference(there.at<2>(p), field.at<2>(p + Vec3d{{0.5, -1, 1.5}})) <= 1e-14);
        const auto a = larger.at<2>(p), b = field.at<2>(p * 1.5);
        REQUIRE(std::abs(a.value - b.value) <= 1e-14); // roundings of positions
        REQUIRE(length(a.gradient - b.gradient * 1.5) <= 1e-13);
        REQUIRE(std::abs(a.hessian(0, 1) - b.hessian(0, 1) * 2.25) <= 1e-13);
    }
}

TEST_CASE("displaced: a displacement without third derivatives is refused", "[field]") {
    const ScalarField f = waves<3>(1), g = waves<3>(2);
    const ScalarField moved = displaced(f, g, 0.3);
    CHECK_THROWS_AS(displaced(f, moved, 0.1), ValueError);
    CHECK_THROWS_WITH(displaced(f, moved, 0.1), Catch::ContainsSubstring("third derivatives"));
    CHECK_THROWS_AS(moved.at<3>({{1, 2, 3}}), ValueError);
    // Nor can fields made from it …
    CHECK_THROWS_AS(displaced(f, moved + g, 0.1), ValueError);
    CHECK_THROWS_AS(displaced(f, clipped(moved, 1), 0.1), ValueError);
    CHECK_THROWS_AS(displaced(f, placed(moved, {.offset = {{1, 2, 3}}}), 0.1), ValueError);
    CHECK_THROWS_AS(displaced(f, noiseField<Psrd3>({}, {.octaves = 2, .warp = 0.1}), 0.1), ValueError);
    // … even if it matters only elsewhere.
    const Wall wall{.sdf = placed(sphereSdf(1), {.offset = {{10, 0, 0}}}), .width = 0.1};
    CHECK_THROWS_AS(displaced(f, bounded(moved, wall), 0.1), ValueError);
    CHECK_NOTHROW(displaced(f, bounded(g, wall), 0.1));
    // It can itself be displaced again.
    const ScalarField twice = displaced(moved, g, 0.3);
    const Vec3d p{{0.1, 0.2, 0.3}};
    CHECK(twice.at<0>(p).value == moved.at<0>(p + g.at<1>(p).gradient * 0.3).value);
    for (const double bad : {std::numeric_limits<double>::infinity(), std::nan("")}) {
        CAPTURE(bad);
        CHECK_THROWS_AS(displaced(f, g, bad), ValueError);
    }
}
