// SPDX-License-Identifier: Apache-2.0
// Longer than 400 lines: each operation on jets has its own derivatives up to the third.
#include "curlew/math/Jet.h"
#include "support/FiniteDifference.h"
#include "support/Formula.h"

#include <set>

using namespace curlew;
using namespace curlew::test;

namespace {

using J2 = Jet<double, 3, 2>;

/// Returns a jet with random components of at most 1 and a value between 1 and 2.
J2 randomJet(uint64_t seed, uint64_t k) {
    J2 jet;
    for (int i = 0; i < J2::kSize; ++i) jet.component(i) = 2 * randomUniform(seed, k, static_cast<uint64_t>(i)) - 1;
    jet.value = 1.5 + jet.value / 2;
    return jet;
}

/// Returns such a jet of any dimension and order.
template <class J>
J anyJet(uint64_t seed, uint64_t k) {
    J jet;
    for (int i = 0; i < J::kSize; ++i)
        jet.component(i) = 2 * randomUniform(seed, k, 100 + static_cast<uint64_t>(i)) - 1;
    jet.value = 1.5 + jet.value / 2;
    return jet;
}

/// A polynomial in N variables with small whole coefficients. Its derivatives follow from the powers of its terms and
/// are exact for whole numbers.
template <int N>
struct Terms {
    struct Term {
        double factor;
        std::array<int, N> powers;
    };
    std::vector<Term> terms;

    /// Random terms with powers of at most 3.
    Terms(uint64_t seed, uint64_t k) {
        for (uint64_t t = 0; t < 5; ++t) {
            Term term{std::floor(9 * randomUniform(seed, k, 50 * t)) - 4, {}};
            for (size_t i = 0; i < N; ++i)
                term.powers[i] = static_cast<int>(4 * randomUniform(seed, k, 50 * t + i + 1));
            terms.push_back(term);
        }
    }
    /// Evaluates numbers or jets.
    template <class X>
    X operator()(const Vec<X, N>& x) const {
        X sum(0.0);
        for (const Term& term : terms) {
            X product(term.factor);
            for (int i = 0; i < N; ++i)
                for (int p = 0; p < term.powers[static_cast<size_t>(i)]; ++p) product = product * x[i];
            sum += product;
        }
        return sum;
    }
    Terms derivative(int axis) const {
        Terms d = *this;
        for (Term& term : d.terms) {
            int& power = term.powers[static_cast<size_t>(axis)];
            term.factor *= power;
            power = std::max(power - 1, 0);
        }
        return d;
    }
    Jet<double, N, 3> exact(const Vec<double, N>& x) const {
        Jet<double, N, 3> jet((*this)(x));
        for (int i = 0; i < N; ++i) {
            const Terms di = derivative(i);
            jet.gradient[i] = di(x);
            for (int j = i; j < N; ++j) {
                const Terms dij = di.derivative(j);
                jet.hessian(i, j) = dij(x);
                for (int k = j; k < N; ++k) jet.third(i, j, k) = dij.derivative(k)(x);
            }
        }
        return jet;
    }
};

template <int N>
Vec<double, N> wholePoint(uint64_t seed, uint64_t k) {
    Vec<double, N> x = randomPoint(cube<N>(3.5), seed, k);
    for (double& c : x.c) c = std::floor(c + 0.5);
    return x;
}

/// Returns A x + b as jets in x.
template <int R, int C>
Vec<Jet<double, C, 3>, R> affine(const Matrix<R, C>& A, const Vec<double, R>& b, const Vec<double, C>& x) {
    Vec<Jet<double, C, 3>, R> y;
    const auto variables = Jet<double, C, 3>::variables(x);
    for (int i = 0; i < R; ++i) {
        y[i] = Jet<double, C, 3>(b[i]);
        for (int j = 0; j < C; ++j) y[i] += variables[j] * A[i][j];
    }
    return y;
}

template <int R, int C>
Matrix<R, C> wholeMatrix(uint64_t seed, uint64_t k) {
    Matrix<R, C> A;
    for (uint64_t i = 0; i < R; ++i) A.rows[i] = wholePoint<C>(seed, k * R + i);
    return A;
}

template <int N, int M>
void checkPullBack() {
    for (uint64_t k = 0; k < 20; ++k) {
        const Terms<N> f(30, k);
        const auto A = wholeMatrix<N, M>(31, k);
        const Vec<double, N> b = wholePoint<N>(32, k);
        const Vec<double, M> x = wholePoint<M>(33, k);
        CAPTURE(N, M, k, x);
        const auto expected = f(affine(A, b, x)); // by the product rule; all numbers are whole
        const auto there = f.exact(A * x + b);
        REQUIRE(difference(pullBack(there, A), expected) == 0);
        REQUIRE(difference(compose(there, affine(A, b, x)), expected) == 0);
        // Jets of lower order are equal to the truncated ones.
        REQUIRE(difference(pullBack(truncated<2>(there), A), truncated<2>(expected)) == 0);
        REQUIRE(difference(pullBack(truncated<1>(there), A), truncated<1>(expected)) == 0);
        REQUIRE(pullBack(truncated<0>(there), A).value == expected.value);
    }
}

template <int N, int M>
void checkCompose() {
    for (uint64_t k = 0; k < 20; ++k) {
        const Terms<N> f(34, k);
        Vec<Jet<double, M, 3>, N> y;
        Vec<double, N> values;
        for (int a = 0; a < N; ++a) {
            y[a] = anyJet<Jet<double, M, 3>>(35, k * N + static_cast<uint64_t>(a));
            values[a] = y[a].value;
        }
        CAPTURE(N, M, k);
        const auto there = f.exact(values), same = f(Jet<double, N, 3>::variables(values));
        const auto direct = f(y), composed = compose(there, y);
        double size = 1;
        for (int c = 0; c < direct.kSize; ++c) size = std::max(size, std::abs(direct.component(c)));
        for (int c = 0; c < there.kSize; ++c) size = std::max(size, std::abs(there.component(c)));
        // About a hundred roundings of terms of this size.
        REQUIRE(difference(there, same) <= 1e-13 * size);
        REQUIRE(difference(composed, direct) <= 1e-13 * size);
        Vec<Jet<double, M, 2>, N> lower;
        for (int a = 0; a < N; ++a) lower[a] = truncated<2>(y[a]);
        REQUIRE(difference(compose(truncated<2>(there), lower), truncated<2>(composed)) == 0);
    }
}

template <int N>
void checkTensorIndex() {
    using S = Sym3<double, N>;
    std::set<int> seen;
    int next = 0;
    for (int k = 0; k < N; ++k)
        for (int j = 0; j <= k; ++j)
            for (int i = 0; i <= j; ++i) {
                CAPTURE(N, i, j, k);
                CHECK(S::index(i, j, k) == next++); // ascending by k, then j, then i
                for (const int other :
                     {S::index(i, k, j), S::index(j, i, k), S::index(j, k, i), S::index(k, i, j), S::index(k, j, i)})
                    CHECK(other == S::index(i, j, k));
                seen.insert(S::index(i, j, k));
            }
    CHECK(seen.size() == size_t{S::kSize});
    CHECK(next == S::kSize);
    int called = 0;
    Jet<double, N, 3>::forTriples([&](int i, int j, int k) { CHECK(S::index(i, j, k) == called++); });
    CHECK(called == S::kSize);
}

/// Tolerance for a few operations on such jets: some dozens of terms of at most 10.
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

TEST_CASE("Sym: index maps each entry of a symmetric matrix to one slot", "[math]") {
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
    // For N = 4, the upper triangle by rows follows the diagonal: 01 02 03 12 13 23.
    CHECK(Sym<double, 4>::index(0, 3) == 6);
    CHECK(Sym<double, 4>::index(2, 1) == 7);
    CHECK(Sym<double, 4>::index(2, 3) == 9);
}

TEST_CASE("Jet: value and gradient and Hessian are stored in one row", "[math]") {
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

TEST_CASE("Jet: arithmetic is commutative and associative and distributive", "[math]") {
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

TEST_CASE("Jet: sqrt and sin and cos satisfy their identities", "[math]") {
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

TEST_CASE("Jet: the product rule is exact on monomials", "[math]") {
    // x² y z³ at (2, 3, -1); all derivatives are computed by hand.
    const J2 x = J2::variable(2, 0), y = J2::variable(3, 1), z = J2::variable(-1, 2);
    const J2 f = x * x * y * z * z * z;
    CHECK(f.value == -12);
    CHECK(f.gradient == Vec3d{{-12, -4, 36}});
    const std::array<double, 6> hessian{-6, 0, -72, -4, 36, 12};
    CHECK(f.hessian.c == hessian);
}

TEST_CASE("Jet: product and chain rules agree with central differences", "[math]") {
    const auto points = randomPoints(cube(1), 200, 6);
    // Generous bounds of the third derivatives within the cube: these functions and their factors have values of 1 … 5
    // and vary over lengths of 1/2 … 1.
    SECTION("product") { requireDerivatives(sinesG(), points, 1e-3, 100); }
    SECTION("sums of sines") { requireDerivatives(sinesF(), points, 1e-3, 100); }
    SECTION("square root") {
        requireDerivatives(formula([](const auto& x) { return sqrt(x[0] * x[1] + x[2] * x[2] * x[0] + 3.0); }), points,
                           1e-3, 100);
    }
    SECTION("nested chain rule") {
        requireDerivatives(formula([](const auto& x) { return sin(cos(x[0] * x[1]) + x[2] * x[2]) * x[0]; }), points,
                           1e-3, 300);
    }
}

TEST_CASE("Jet: lower orders and float evaluate the same formula", "[math]") {
    const auto f = sinesG();
    for (const Vec3d& p : randomPoints(cube(1), 200, 7)) {
        const auto jet = f.at<2>(p);
        const auto first = f.at<1>(p);
        CAPTURE(p);
        REQUIRE(f.at<0>(p).value == jet.value);
        REQUIRE(first.value == jet.value);
        REQUIRE(first.gradient == jet.gradient);
        const auto single = f.at<1, float>(p);
        // A few dozen roundings of terms of at most 20.
        for (int k = 0; k < single.kSize; ++k)
            REQUIRE(std::abs(double(single.component(k)) - jet.component(k)) < 20 * 12 * 0x1p-23);
    }
}

TEST_CASE("pullBack: is the chain rule for a linear map", "[math]") {
    Matrix3 A, B;
    for (uint64_t i = 0; i < 3; ++i) {
        A.rows[i] = randomPoint(cube(1), 8, i);
        B.rows[i] = randomPoint(cube(1), 9, i);
    }
    const ScalarField f = sinesG();
    const Vec3d b{{0.3, -0.2, 0.9}};
    SECTION("agrees with central differences") {
        for (const Vec3d& p : randomPoints(cube(1), 100, 10)) {
            const J2 jet = pullBack(f.at<2>(A * p + b), A);
            const auto pulled = [&](const Vec3d& q) { return f.at<0>(A * q + b).value; };
            const auto pulledGradient = [&](const Vec3d& q) { return pullBack(f.at<1>(A * q + b), A).gradient; };
            const double h = 1e-3;
            CAPTURE(p);
            // Third derivatives of f are at most 100, along vectors of at most sqrt 3: h²/6 · 100 · 3^1.5.
            const double tolerance = h * h / 6 * 100 * std::pow(3, 1.5);
            REQUIRE(length(gradientFd(pulled, p, h) - jet.gradient) < tolerance);
            for (int j = 0; j < 3; ++j) {
                const Vec3d row = (pulledGradient(p + unit(j) * h) - pulledGradient(p - unit(j) * h)) * (0.5 / h);
                for (int i = 0; i < 3; ++i) REQUIRE(std::abs(row[i] - jet.hessian(i, j)) < tolerance);
            }
        }
    }
    SECTION("composes like the matrix product and the identity changes nothing") {
        for (uint64_t k = 0; k < 100; ++k) {
            const J2 jet = randomJet(11, k);
            CAPTURE(k);
            REQUIRE(difference(pullBack(pullBack(jet, A), B), pullBack(jet, A * B)) <= kRounding);
            REQUIRE(difference(pullBack(jet, Matrix3{}), jet) == 0);
        }
    }
}

TEST_CASE("Sym3: index maps each entry of a symmetric tensor to one slot", "[math]") {
    checkTensorIndex<1>();
    checkTensorIndex<2>();
    checkTensorIndex<3>();
    checkTensorIndex<4>();
    checkTensorIndex<7>();
    STATIC_REQUIRE(Sym3<double, 3>::kSize == 10);
    STATIC_REQUIRE(Sym3<double, 7>::kSize == 84);
}

TEST_CASE("Jet: third derivatives are stored after the Hessian", "[math]") {
    using J = Jet<double, 2, 3>;
    STATIC_REQUIRE(J::kSize == 10);
    STATIC_REQUIRE(Jet<double, 3, 3>::kSize == 20);
    STATIC_REQUIRE(Jet<double, 1, 3>::kSize == 4);
    J jet;
    for (int k = 0; k < J::kSize; ++k) jet.component(k) = k;
    CHECK(jet.value == 0);
    CHECK(jet.gradient == Vec<double, 2>{{1, 2}});
    CHECK(jet.hessian(0, 0) == 3);
    CHECK(jet.hessian(1, 1) == 4);
    CHECK(jet.hessian(1, 0) == 5);
    CHECK(jet.third(0, 0, 0) == 6);
    CHECK(jet.third(0, 1, 0) == 7);
    CHECK(jet.third(1, 0, 1) == 8);
    CHECK(jet.third(1, 1, 1) == 9);
    for (int k = 0; k < J::kSize; ++k) {
        CAPTURE(k);
        CHECK((jet + jet).component(k) == 2 * k);
        CHECK((jet * 3.0 - jet).component(k) == 2 * k);
    }
}

TEMPLATE_TEST_CASE_SIG("Jet: all derivatives of polynomials up to the third are exact", "[math]", ((int N), N), 1, 2, 3,
                       5) {
    for (uint64_t k = 0; k < 50; ++k) {
        const Terms<N> f(20, k), g(21, k);
        const Vec<double, N> x = wholePoint<N>(22, k);
        const auto variables = Jet<double, N, 3>::variables(x);
        CAPTURE(N, k, x);
        const auto jet = f(variables);
        REQUIRE(difference(jet, f.exact(x)) == 0);
        for (int i = 0; i < N; ++i) {
            REQUIRE(difference(partial(jet, i), truncated<2>(f.derivative(i).exact(x))) == 0);
            REQUIRE(difference(partial(truncated<2>(jet), i), truncated<1>(f.derivative(i).exact(x))) == 0);
            REQUIRE(partial(truncated<1>(jet), i).value == f.derivative(i)(x));
            for (int j = 0; j < N; ++j) {
                REQUIRE(difference(partial(partial(jet, i), j), partial(partial(jet, j), i)) == 0);
                // Leibniz's rule, computed independently.
                const auto other = g(variables), both = jet * other;
                REQUIRE(difference(partial(both, j),
                                   partial(jet, j) * truncated<2>(other) + truncated<2>(jet) * partial(other, j)) == 0);
            }
        }
    }
}

TEST_CASE("truncated: operations commute with dropping higher derivatives", "[math]") {
    using J = Jet<double, 3, 3>;
    for (uint64_t k = 0; k < 100; ++k) {
        const J a = anyJet<J>(23, k), b = anyJet<J>(24, k);
        CAPTURE(k);
        REQUIRE(difference(truncated<2>(a * b), truncated<2>(a) * truncated<2>(b)) == 0);
        REQUIRE(difference(truncated<1>(sqrt(a)), sqrt(truncated<1>(a))) == 0);
        REQUIRE(difference(truncated<2>(log(a)), log(truncated<2>(a))) == 0);
        REQUIRE(truncated<0>(sin(a)).value == sin(truncated<0>(a)).value);
        REQUIRE(difference(truncated<3>(a), a) == 0);
        REQUIRE(difference(truncated<1>(truncated<2>(a)), truncated<1>(a)) == 0);
    }
}

TEMPLATE_TEST_CASE_SIG("Jet: functions of third-order jets satisfy their identities", "[math]", ((int N), N), 1, 2, 3) {
    using J = Jet<double, N, 3>;
    // Terms are sums of up to a dozen products of three, divided by the fourth power of a value of at least 1.
    constexpr double kMany = 1e-12;
    for (uint64_t k = 0; k < 200; ++k) {
        const J a = anyJet<J>(25, k), b = anyJet<J>(26, k), c = anyJet<J>(27, k);
        CAPTURE(N, k);
        REQUIRE(difference(a * b, b * a) <= kMany);
        REQUIRE(difference((a * b) * c, a * (b * c)) <= kMany);
        REQUIRE(difference(a * (b + c), a * b + a * c) <= kMany);
        REQUIRE(difference(sqrt(a) * sqrt(a), a) <= kMany);
        REQUIRE(difference(sqrt(a * a), a) <= kMany);
        REQUIRE(difference(sin(a) * sin(a) + cos(a) * cos(a), J(1.0)) <= kMany);
        REQUIRE(difference(sin(a + b), sin(a) * cos(b) + cos(a) * sin(b)) <= kMany);
        REQUIRE(difference(cos(a + b), cos(a) * cos(b) - sin(a) * sin(b)) <= kMany);
        REQUIRE(difference(reciprocal(a) * a, J(1.0)) <= kMany);
        REQUIRE(difference(reciprocal(reciprocal(a)), a) <= kMany);
        REQUIRE(difference(reciprocal(-a), -reciprocal(a)) == 0);
        REQUIRE(difference(log(a * b), log(a) + log(b)) <= kMany);
        REQUIRE(difference(log(reciprocal(a)), -log(a)) <= kMany);
        for (int i = 0; i < N; ++i) { // log' = 1 / a
            const auto lower = truncated<2>(a);
            REQUIRE(difference(partial(log(a), i), reciprocal(lower) * partial(a, i)) <= kMany);
            REQUIRE(difference(partial(sqrt(a), i) * sqrt(lower) * 2.0, partial(a, i)) <= kMany);
            REQUIRE(difference(partial(sin(a), i), cos(lower) * partial(a, i)) <= kMany);
        }
        // The chain rule for a cube, whose derivatives are known.
        const double v = a.value;
        REQUIRE(difference(compose(a, Univariate<double>{v * v * v, 3 * v * v, 6 * v, 6}), a * a * a) <= kMany);
        REQUIRE(difference(abs(-a), a) == 0);
        REQUIRE(difference(max(a, a - J(1.0)), a) == 0);
    }
}

TEST_CASE("Jet: third derivatives agree with central differences", "[math]") {
    const auto points = randomPoints(cube(1), 200, 28);
    constexpr double kStep = 0x1p-8;
    const auto positive = [](const auto& x) { return x[0] * x[1] + x[2] * x[2] * x[0] + 3.0; };
    SECTION("product and sine") { requireThirdDerivatives(sinesG(), points, kStep); }
    SECTION("cosine") { requireThirdDerivatives(sinesF(), points, kStep); }
    SECTION("square root") {
        requireThirdDerivatives(formula([=](const auto& x) { return sqrt(positive(x)); }), points, kStep);
    }
    SECTION("logarithm") {
        requireThirdDerivatives(formula([=](const auto& x) { return log(positive(x)); }), points, kStep);
    }
    SECTION("reciprocal") {
        requireThirdDerivatives(formula([=](const auto& x) { return reciprocal(positive(x)) * x[1]; }), points, kStep);
    }
    SECTION("nested chain rule") {
        requireThirdDerivatives(formula([](const auto& x) { return sin(cos(x[0] * x[1]) + x[2] * x[2]) * x[0]; }),
                                points, kStep);
    }
    SECTION("five variables") {
        requireThirdDerivatives(formula<5>([](const auto& x) {
                                    return sin(x[0] + x[1] * x[2]) * cos(x[3] * 2 - x[4]) + sqrt(x[4] * x[0] + 2.0);
                                }),
                                randomPoints(cube<5>(1), 100, 29), kStep);
    }
}

TEST_CASE("pullBack: accepts rectangular matrices", "[math]") {
    checkPullBack<1, 1>();
    checkPullBack<1, 3>();
    checkPullBack<2, 3>();
    checkPullBack<3, 2>();
    checkPullBack<3, 3>();
    checkPullBack<5, 2>();
    checkPullBack<4, 1>();
}

TEST_CASE("compose: the chain rule in several variables agrees with the product rule", "[math]") {
    checkCompose<1, 1>();
    checkCompose<1, 3>();
    checkCompose<2, 3>();
    checkCompose<3, 2>();
    checkCompose<3, 3>();
    checkCompose<4, 1>();
}
