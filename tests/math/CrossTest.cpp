// SPDX-License-Identifier: Apache-2.0
#include "curlew/math/Cross.h"
#include "curlew/math/Jet.h"
#include "support/Determinant.h"
#include "support/Points.h"
#include "support/Reference.h"

#include <limits>

using namespace curlew;
using namespace curlew::test;

namespace {

template <int N>
using Vectors = std::array<Vec<double, N>, size_t{N - 1}>;

/// Returns a vector of whole numbers from -most to most, for which all results below are exact.
template <int N>
Vec<double, N> wholeVector(uint64_t seed, uint64_t k, int most = 4) {
    Vec<double, N> v = randomPoint(cube<N>(most + 0.5), seed, k);
    for (double& x : v.c) x = std::floor(x + 0.5);
    return v;
}

template <int N>
Vectors<N> wholeVectors(uint64_t seed, uint64_t k) {
    Vectors<N> v;
    for (size_t i = 0; i < v.size(); ++i) v[i] = wholeVector<N>(seed, k * v.size() + i);
    return v;
}

/// Computes det[v | v1 | …].
template <class T, int N>
T determinantWith(const Vec<T, N>& v, const std::array<Vec<T, N>, size_t{N - 1}>& others) {
    std::array<Vec<T, N>, size_t{N}> all;
    all[0] = v;
    std::copy(others.begin(), others.end(), all.begin() + 1);
    return determinant(all);
}

template <int N>
void checkReference(const nlohmann::json& row) {
    Vectors<N> v;
    Vec<double, N> expected;
    for (size_t i = 0; i < v.size(); ++i) v[i].c = row.at("v_f64").at(i).get<std::array<double, size_t{N}>>();
    expected.c = row.at("cross_f64").get<std::array<double, size_t{N}>>();
    // About a hundred roundings of products that can exceed their sum.
    CAPTURE(N, row.at("id").get<int>());
    CHECK(length(cross(v) - expected) <= 1e-12 * length(expected));
}

} // namespace

TEST_CASE("cross: agrees with reference values in two to seven dimensions", "[math]") {
    forRowsInDimensions("dfvn_cross.json", {2, 3, 4, 5, 6, 7},
                        [](const auto& row, auto dimension) { checkReference<dimension>(row); });
}

TEST_CASE("cross: is the usual cross product in two and three dimensions", "[math]") {
    STATIC_REQUIRE(cross(std::array{Vec<double, 2>{{2, 5}}}) == Vec<double, 2>{{5, -2}});
    for (uint64_t k = 0; k < 100; ++k) {
        const Vectors<3> v{randomPoint(cube(1), 1, k), randomPoint(cube(1), 2, k)};
        CAPTURE(v[0], v[1]);
        REQUIRE(cross(v) == cross(v[0], v[1]));
    }
}

TEMPLATE_TEST_CASE_SIG("cross: the cross product of all axes but one is that axis with its sign", "[math]",
                       ((int N), N), 2, 3, 4, 5, 6, 7) {
    // Eq. 1 for e_j and the other axes in order: det[e_j | others] = (-1)^j.
    for (int j = 0; j < N; ++j) {
        Vectors<N> others;
        for (int i = 0; i < N; ++i)
            if (i != j) others[static_cast<size_t>(i - (i > j))][i] = 1;
        Vec<double, N> expected;
        expected[j] = j % 2 ? -1 : 1;
        CAPTURE(N, j);
        CHECK(cross(others) == expected);
    }
}

TEMPLATE_TEST_CASE_SIG("cross: agrees with determinants in every dimension", "[math]", ((int N), N), 2, 3, 4, 5, 6, 7) {
    for (uint64_t k = 0; k < 20; ++k) {
        const Vectors<N> v = wholeVectors<N>(3, k);
        const Vec<double, N> c = cross(v), w = wholeVector<N>(4, k);
        CAPTURE(N, k, c, w);
        // ICN Eq. 1.
        REQUIRE(dot(c, w) == determinantWith(w, v));
        for (const auto& each : v) REQUIRE(dot(c, each) == 0);
        // Its length is the volume of the parallelepiped of the vectors.
        std::array<Vec<double, N - 1>, size_t{N - 1}> gram;
        for (size_t i = 0; i < v.size(); ++i)
            for (size_t j = 0; j < v.size(); ++j) gram[i].c[j] = dot(v[i], v[j]);
        REQUIRE(dot(c, c) == determinant(gram));
        if constexpr (N > 2) { // swapping vectors changes its sign; dependent vectors give zero
            Vectors<N> other = v;
            std::swap(other[0], other[static_cast<size_t>(N - 2)]);
            REQUIRE(cross(other) == -c);
            other[0] = other[1] * 2.0;
            REQUIRE(cross(other) == Vec<double, N>{});
            for (size_t i = 2; i < other.size(); ++i) other[0] += other[i];
            REQUIRE(cross(other) == Vec<double, N>{});
        }
    }
}

TEMPLATE_TEST_CASE_SIG("cross: is orthogonal to its arguments to rounding", "[math]", ((int N), N), 2, 3, 4, 5, 6, 7) {
    double worst = 0;
    for (uint64_t k = 0; k < 200; ++k) {
        Vectors<N> v;
        double sizes = 1;
        for (size_t i = 0; i < v.size(); ++i) v[i] = randomPoint(cube<N>(1), 5 + i, k);
        // A component is a sum of (N-1)! products of N-1 numbers below 1, and a scalar product has N of these.
        for (int i = 2; i <= N; ++i) sizes *= i;
        const Vec<double, N> c = cross(v);
        for (const auto& each : v) worst = std::max(worst, std::abs(dot(c, each)) / sizes);
    }
    // Each result has at most 2 N roundings.
    CHECK(worst <= 2 * N * 0x1p-53);
}

TEMPLATE_TEST_CASE_SIG("cross: the cross product of jets carries its derivatives", "[math]", ((int N), N), 2, 3, 4, 5) {
    using J = Jet<double, 2, 2>;
    for (uint64_t k = 0; k < 10; ++k) {
        std::array<Vec<J, N>, size_t{N - 1}> v;
        Vectors<N> values;
        for (size_t i = 0; i < v.size(); ++i)
            for (int axis = 0; axis < N; ++axis) {
                const auto jet = wholeVector<J::kSize>(20 + i, k * N + static_cast<uint64_t>(axis), 3);
                for (int c = 0; c < J::kSize; ++c) v[i][axis].component(c) = jet[c];
                values[i][axis] = jet[0];
            }
        const Vec<J, N> c = cross(v);
        CAPTURE(N, k);
        for (int axis = 0; axis < N; ++axis) {
            Vec<J, N> e;
            e[axis] = J(1.0);
            CAPTURE(axis);
            REQUIRE(difference(c[axis], determinantWith(e, v)) == 0);
            REQUIRE(c[axis].value == cross(values)[axis]);
            // It is linear in each vector, so the gradient is a sum of cross products.
            for (int i = 0; i < 2; ++i) {
                double slope = 0;
                for (size_t m = 0; m < v.size(); ++m) {
                    Vectors<N> moved = values;
                    for (int a = 0; a < N; ++a) moved[m][a] = v[m][a].gradient[i];
                    slope += cross(moved)[axis];
                }
                REQUIRE(c[axis].gradient[i] == slope);
            }
        }
    }
}
