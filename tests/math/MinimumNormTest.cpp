// SPDX-License-Identifier: Apache-2.0
#include "curlew/math/Cross.h"
#include "curlew/math/MinimumNorm.h"
#include "support/Points.h"
#include "support/Reference.h"

#include <limits>

using namespace curlew;
using namespace curlew::test;

namespace {

template <int N, size_t M>
std::array<Vec<double, N>, M> randomRows(uint64_t seed, uint64_t k) {
    std::array<Vec<double, N>, M> rows;
    for (size_t i = 0; i < M; ++i) rows[i] = randomPoint(cube<N>(1), seed, k * M + i);
    return rows;
}

template <int N, size_t M>
double residual(const std::array<Vec<double, N>, M>& J, const std::array<double, M>& r, const Vec<double, N>& v) {
    double worst = 0;
    for (size_t i = 0; i < M; ++i) worst = std::max(worst, std::abs(dot(J[i], v) - r[i]));
    return worst;
}

template <int N>
void checkReference(const nlohmann::json& row) {
    constexpr size_t kRows{N - 1};
    std::array<Vec<double, N>, kRows> J;
    for (size_t i = 0; i < kRows; ++i) J[i].c = row.at("J_f64").at(i).get<std::array<double, size_t{N}>>();
    const auto r = row.at("r_f64").get<std::array<double, kRows>>();
    Vec<double, N> expected;
    expected.c = row.at("v_f64").get<std::array<double, size_t{N}>>();
    CAPTURE(N, row.at("id").get<int>());
    // A hundred roundings, including those of the inputs, times the condition number.
    CHECK(length(minimumNorm(J, r) - expected) <= 100 * 0x1p-53 * row.at("cond").get<double>() * length(expected));
}

template <int N, size_t M>
void checkRandom() {
    double worstResidual = 0, worstRowSpace = 0, worstOther = 0;
    for (uint64_t k = 0; k < 200; ++k) {
        const auto J = randomRows<N, M>(1, k);
        std::array<double, M> r;
        for (size_t i = 0; i < M; ++i) r[i] = 2 * randomUniform(2, k, i) - 1;
        const auto v = minimumNorm(J, r);
        // The part of a random w that is orthogonal to the rows of J lies in the null space. v must have no component
        // in it.
        const Vec<double, N> w = randomPoint(cube<N>(1), 3, k);
        std::array<double, M> seen;
        for (size_t i = 0; i < M; ++i) seen[i] = dot(J[i], w);
        const Vec<double, N> null = w - minimumNorm(J, seen);
        const double size = 1 + length(v) + length(w);
        worstResidual = std::max(worstResidual, residual(J, r, v) / size);
        worstOther = std::max(worstOther, residual(J, std::array<double, M>{}, null) / size);
        worstRowSpace = std::max(worstRowSpace, std::abs(dot(null, v)) / (size * size));
        if constexpr (M + 1 == N)
            worstRowSpace = std::max(worstRowSpace, std::abs(dot(cross(J), v)) / (length(cross(J)) * size));
    }
    CAPTURE(N, M);
    // Roundings times the condition numbers of random rows. Observed are 5e-14, 2e-15 and 9e-15.
    CHECK(worstResidual <= 1e-12);
    CHECK(worstOther <= 1e-12);
    CHECK(worstRowSpace <= 1e-12);
}

} // namespace

TEST_CASE("minimumNorm: agrees with reference values", "[math]") {
    forRowsInDimensions("dfvn_minnorm.json", {2, 3, 4, 5, 6, 7},
                        [](const auto& row, auto dimension) { checkReference<dimension>(row); });
}

TEST_CASE("minimumNorm: the solution satisfies the equations and lies in the row space", "[math]") {
    checkRandom<1, 1>();
    checkRandom<2, 1>();
    checkRandom<2, 2>();
    checkRandom<3, 1>();
    checkRandom<3, 2>();
    checkRandom<3, 3>();
    checkRandom<4, 3>();
    checkRandom<5, 2>();
    checkRandom<5, 4>();
    checkRandom<6, 5>();
    checkRandom<7, 6>();
}

TEST_CASE("minimumNorm: with one equation the solution is parallel to its row", "[math]") {
    CHECK(minimumNorm(std::array{Vec3d{{0, 4, 3}}}, std::array{50.0}) == Vec3d{{0, 8, 6}});
    STATIC_REQUIRE(minimumNorm(std::array{Vec3d{{0, 2, 0}}}, std::array{3.0}) == Vec3d{{0, 1.5, 0}});
}

TEST_CASE("minimumNorm: of linearly dependent rows the first ones win", "[math]") {
    const Vec3d a{{1, 2, -2}}, b{{0, 1, 1}};
    const auto expected = minimumNorm(std::array{a, b}, std::array{9.0, 4.0});
    SECTION("the same row twice with different right-hand sides") {
        CHECK(minimumNorm(std::array{a, a, b}, std::array{9.0, -5.0, 4.0}) == expected);
        CHECK(minimumNorm(std::array{a, a}, std::array{9.0, -5.0}) == Vec3d{{1, 2, -2}});
        CHECK(minimumNorm(std::array{a, a * -3.0}, std::array{9.0, 1.0}) == Vec3d{{1, 2, -2}});
    }
    SECTION("a linear combination of earlier rows") {
        CHECK(minimumNorm(std::array{a, b, a * 0.5 - b * 3.0}, std::array{9.0, 4.0, 100.0}) == expected);
    }
    SECTION("zero rows are ignored") {
        CHECK(minimumNorm(std::array{Vec3d{}, a, b}, std::array{7.0, 9.0, 4.0}) == expected);
        CHECK(minimumNorm(std::array{a, Vec3d{}, b}, std::array{9.0, 7.0, 4.0}) == expected);
        CHECK(minimumNorm(std::array{a, b, Vec3d{}}, std::array{9.0, 4.0, 7.0}) == expected);
        CHECK(minimumNorm(std::array{Vec3d{}, Vec3d{}}, std::array{1.0, 2.0}) == Vec3d{});
    }
    SECTION("random rows") {
        for (uint64_t k = 0; k < 100; ++k) {
            auto J = randomRows<5, 4>(4, k);
            std::array<double, 4> r;
            for (size_t i = 0; i < 4; ++i) r[i] = randomUniform(5, k, i);
            J[2] = J[0] * randomUniform(6, k) + J[1] * -2.0; // r contradicts it
            const auto v = minimumNorm(J, r);
            CAPTURE(k, v);
            for (const size_t i : {size_t{0}, size_t{1}, size_t{3}})
                REQUIRE(std::abs(dot(J[i], v) - r[i]) <=
                        1e-11 * (1 + length(v))); // rounding with a bad condition number
        }
    }
}

TEST_CASE("minimumNorm: the threshold for parallel rows is the squared sine of their angle", "[math]") {
    // The angle between the rows has the tangent 1e-3.
    const std::array J{Vec<double, 2>{{1, 0}}, Vec<double, 2>{{5, 5e-3}}};
    const std::array r{1.0, 5.01};
    CHECK(length(minimumNorm(J, r, 0.9e-6) - Vec<double, 2>{{1, 2}}) < 1e-12); // roundings of 5 over 5e-3
    CHECK(minimumNorm(J, r, 1.1e-6) == Vec<double, 2>{{1, 0}});
    CHECK(length(minimumNorm(J, r) - Vec<double, 2>{{1, 2}}) < 1e-12);
}

TEST_CASE("minimumNorm: scaling a row does not change the solution", "[math]") {
    for (uint64_t k = 0; k < 100; ++k) {
        auto J = randomRows<4, 3>(7, k);
        std::array<double, 3> r{1, -2, 0.5};
        const auto expected = minimumNorm(J, r);
        for (size_t i = 0; i < 3; ++i) { // powers of two are exact
            const double unit = std::ldexp(1.0, 300 * (static_cast<int>(i) - 1));
            J[i] *= unit;
            r[i] *= unit;
        }
        CAPTURE(k);
        REQUIRE(minimumNorm(J, r) == expected);
    }
}
