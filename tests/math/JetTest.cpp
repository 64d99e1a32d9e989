#include "curlew/math/Jet.h"
#include "support/FiniteDifference.h"
#include "support/Formula.h"

#include <set>

using namespace curlew;
using namespace curlew::test;

namespace {

using J2 = Jet<double, 3, 2>;

/// A jet with random components of at most 1; its value between 1 and 2.
J2 randomJet(uint64_t seed, uint64_t k) {
    J2 jet;
    for (int i = 0; i < J2::kSize; ++i) jet.component(i) = 2 * randomUniform(seed, k, static_cast<uint64_t>(i)) - 1;
    jet.value = 1.5 + jet.value / 2;
    return jet;
}

/// Rounding in a few operations on such jets: some dozens of terms of at most 10.
constexpr double kRounding = 1e-13;

template <int N>
void checkSymmetricIndex() {
    std::set<int> seen;
    for (int i = 0; i < N; ++i)
        for (int j = 0; j < N; ++j) {
            CAPTURE(N, i, j);
            CHECK(Sym<double, N>::index(i, j) == Sym<double, N>::index(j, i));
            seen.insert(Sym<double, N>::index(i, j));
        }
    CHECK(seen.size() == size_t{Sym<double, N>::kSize});
    CHECK(*seen.begin() == 0);
    CHECK(*seen.rbegin() == Sym<double, N>::kSize - 1);
}

} // namespace

TEST_CASE("a symmetric matrix has each entry once", "[math]") {
    checkSymmetricIndex<1>();
    checkSymmetricIndex<2>();
    checkSymmetricIndex<3>();
    checkSymmetricIndex<4>();
    checkSymmetricIndex<7>();
    using S = Sym<double, 3>;
    const std::array<std::pair<int, int>, 6> order{{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};
    for (int k = 0; k < 6; ++k) {
        const auto [i, j] = order[static_cast<size_t>(k)];
        CHECK(S::index(i, j) == k);
    }
    // Upper triangle by rows for N = 4: 01 02 03 12 13 23 after the diagonal.
    CHECK(Sym<double, 4>::index(0, 3) == 6);
    CHECK(Sym<double, 4>::index(2, 1) == 7);
    CHECK(Sym<double, 4>::index(2, 3) == 9);
}

TEST_CASE("a jet holds value, gradient and Hessian in one row", "[math]") {
    STATIC_REQUIRE(Jet<float, 3, 0>::kSize == 1);
    STATIC_REQUIRE(Jet<float, 3, 1>::kSize == 4);
    STATIC_REQUIRE(Jet<float, 3, 2>::kSize == 10);
    STATIC_REQUIRE(Jet<float, 5, 2>::kSize == 21);
    STATIC_REQUIRE(sizeof(Jet<double, 3, 0>) == sizeof(double));
    J2 jet;
    for (int k = 0; k < 10; ++k) jet.component(k) = k;
    CHECK(jet.value == 0);
    CHECK(jet.gradient == Vec3d{{1, 2, 3}});
    CHECK(jet.hessian(0, 0) == 4);
    CHECK(jet.hessian(2, 0) == 8);
    CHECK(jet.hessian(1, 2) == 9);
    const J2 constant = 3.0, y = J2::variable(5, 1);
    CHECK(difference(constant * 0.0, J2()) == 0);
    CHECK(constant.value == 3);
    CHECK(constant.gradient == Vec3d{});
    CHECK(y.value == 5);
    CHECK(y.gradient == Vec3d{{0, 1, 0}});
}

TEST_CASE("jets obey the laws of algebra", "[math]") {
    for (uint64_t k = 0; k < 300; ++k) {
        const J2 a = randomJet(1, k), b = randomJet(2, k), c = randomJet(3, k);
        CAPTURE(k);
        REQUIRE(difference(a * b, b * a) <= kRounding);
        REQUIRE(difference((a * b) * c, a * (b * c)) <= kRounding);
        REQUIRE(difference(a * (b + c), a * b + a * c) <= kRounding);
        REQUIRE(difference(a - b, a + -b) == 0);
        REQUIRE(difference(a * J2(2.0), a * 2.0) == 0);
        REQUIRE(difference(2.0 * a, a + a) == 0);
        REQUIRE(difference(a - a, J2()) == 0);
    }
}

TEST_CASE("square root, sine and cosine of jets satisfy their identities", "[math]") {
    for (uint64_t k = 0; k < 300; ++k) {
        const J2 a = randomJet(4, k), b = randomJet(5, k);
        CAPTURE(k);
        REQUIRE(difference(sqrt(a) * sqrt(a), a) <= kRounding);
        REQUIRE(difference(sqrt(a * a), a) <= kRounding);
        REQUIRE(difference(sin(a) * sin(a) + cos(a) * cos(a), J2(1.0)) <= kRounding);
        REQUIRE(difference(sin(a + b), sin(a) * cos(b) + cos(a) * sin(b)) <= kRounding);
        REQUIRE(difference(cos(a + b), cos(a) * cos(b) - sin(a) * sin(b)) <= kRounding);
        REQUIRE(difference(abs(-a), a) == 0);
        REQUIRE(difference(max(a, a + J2(1.0)), a + J2(1.0)) == 0);
        REQUIRE(difference(max(a, a - J2(1.0)), a) == 0);
    }
}

TEST_CASE("the product rule on monomials is exact", "[math]") {
    // x² y z³ at (2, 3, -1), all derivatives by hand.
    const J2 x = J2::variable(2, 0), y = J2::variable(3, 1), z = J2::variable(-1, 2);
    const J2 f = x * x * y * z * z * z;
    CHECK(f.value == -12);
    CHECK(f.gradient == Vec3d{{-12, -4, 36}});
    const std::array<double, 6> hessian{-6, 0, -72, -4, 36, 12};
    CHECK(f.hessian.c == hessian);
}

TEST_CASE("the product and chain rules agree with central differences", "[math]") {
    const auto points = randomPoints(cube(1), 200, 6);
    // The largest third derivatives within the cube, generously: these functions and their factors are of size 1 … 5
    // and vary on lengths of 1/2 … 1.
    SECTION("product") { requireDerivatives(sinesG(), points, 1e-3, 100); }
    SECTION("sums of sines") { requireDerivatives(sinesF(), points, 1e-3, 100); }
    SECTION("root") {
        requireDerivatives(formula([](const auto& x) { return sqrt(x[0] * x[1] + x[2] * x[2] * x[0] + 3.0); }), points,
                           1e-3, 100);
    }
    SECTION("chain of chains") {
        requireDerivatives(formula([](const auto& x) { return sin(cos(x[0] * x[1]) + x[2] * x[2]) * x[0]; }), points,
                           1e-3, 300);
    }
}

TEST_CASE("lower orders and float are the same formula", "[math]") {
    const auto f = sinesG();
    for (const Vec3d& p : randomPoints(cube(1), 200, 7)) {
        const auto jet = f.at<2>(p);
        const auto first = f.at<1>(p);
        CAPTURE(p);
        REQUIRE(f.at<0>(p).value == jet.value);
        REQUIRE(first.value == jet.value);
        REQUIRE(first.gradient == jet.gradient);
        const auto single = f.at<2, float>(p);
        // Some dozen roundings of terms of at most 20, the largest second derivative.
        for (int k = 0; k < J2::kSize; ++k)
            REQUIRE(std::abs(double(single.component(k)) - jet.component(k)) < 20 * 12 * 0x1p-23);
    }
}

TEST_CASE("pullBack is the chain rule for a linear map", "[math]") {
    Matrix3 A, B;
    for (uint64_t i = 0; i < 3; ++i) {
        A.rows[i] = randomPoint(cube(1), 8, i);
        B.rows[i] = randomPoint(cube(1), 9, i);
    }
    const ScalarField f = sinesG();
    const Vec3d b{{0.3, -0.2, 0.9}};
    SECTION("against central differences") {
        for (const Vec3d& p : randomPoints(cube(1), 100, 10)) {
            const J2 jet = pullBack(f.at<2>(A * p + b), A);
            const auto pulled = [&](const Vec3d& q) { return f.at<0>(A * q + b).value; };
            const auto pulledGradient = [&](const Vec3d& q) { return pullBack(f.at<1>(A * q + b), A).gradient; };
            const double h = 1e-3;
            CAPTURE(p);
            // Third derivatives of f of at most 100, along vectors of at most sqrt 3: h²/6 · 100 · 3^1.5.
            const double tolerance = h * h / 6 * 100 * std::pow(3, 1.5);
            REQUIRE(length(gradientFd(pulled, p, h) - jet.gradient) < tolerance);
            for (int j = 0; j < 3; ++j) {
                const Vec3d row = (pulledGradient(p + unit(j) * h) - pulledGradient(p - unit(j) * h)) * (0.5 / h);
                for (int i = 0; i < 3; ++i) REQUIRE(std::abs(row[i] - jet.hessian(i, j)) < tolerance);
            }
        }
    }
    SECTION("one map after the other is their product, and the identity does nothing") {
        for (uint64_t k = 0; k < 100; ++k) {
            const J2 jet = randomJet(11, k);
            CAPTURE(k);
            REQUIRE(difference(pullBack(pullBack(jet, A), B), pullBack(jet, A * B)) <= kRounding);
            REQUIRE(difference(pullBack(jet, Matrix3{}), jet) == 0);
        }
    }
}
