// SPDX-License-Identifier: Apache-2.0
#include "curlew/math/Vec.h"
#include "support/Points.h"
#include "support/Reference.h"

#include <limits>

using namespace curlew;
using namespace curlew::test;

namespace {

Vec3d vec(const nlohmann::json& a) { return {{a.at(0).get<double>(), a.at(1).get<double>(), a.at(2).get<double>()}}; }

Matrix3 randomMatrix(uint64_t seed) {
    Matrix3 m;
    for (uint64_t i = 0; i < 3; ++i) m.rows[i] = randomPoint(cube(2), seed, i);
    return m;
}

} // namespace

TEST_CASE("Vec: operators are those of linear algebra", "[math]") {
    const Vec3d a{{1, -2, 3}}, b{{0.5, 4, -1}};
    CHECK(a + b == Vec3d{{1.5, 2, 2}});
    CHECK(a - b == Vec3d{{0.5, -6, 4}});
    CHECK(-a == Vec3d{{-1, 2, -3}});
    CHECK(a * 2.0 == Vec3d{{2, -4, 6}});
    CHECK(2.0 * a == a * 2.0);
    CHECK(dot(a, b) == -10.5);
    CHECK(dot(Vec<double, 5>{{1, 2, 3, 4, 5}}, Vec<double, 5>{{5, 4, 3, 2, 1}}) == 35);
    CHECK(length(Vec3d{{2, -3, 6}}) == 7);
    CHECK(Vec3d{} == Vec3d{{0, 0, 0}});
}

TEST_CASE("cross: is right-handed and orthogonal and has the length given by the Gram determinant", "[math]") {
    const Vec3d x{{1, 0, 0}}, y{{0, 1, 0}}, z{{0, 0, 1}};
    STATIC_REQUIRE(cross(Vec3d{{1, 0, 0}}, Vec3d{{0, 1, 0}}) == Vec3d{{0, 0, 1}});
    CHECK(cross(y, z) == x);
    CHECK(cross(z, x) == y);
    for (uint64_t k = 0; k < 1000; ++k) {
        const Vec3d a = randomPoint(cube(1), 1, k), b = randomPoint(cube(1), 2, k), v = randomPoint(cube(1), 3, k);
        const Vec3d c = cross(a, b);
        CAPTURE(a, b, v);
        // Sums of at most twelve products of numbers below 1: at most 16 roundings of 1.
        constexpr double kRounding = 16 * 0x1p-53;
        REQUIRE(std::abs(dot(c, a)) <= kRounding);
        REQUIRE(std::abs(dot(c, b)) <= kRounding);
        REQUIRE(std::abs(dot(c, c) - (dot(a, a) * dot(b, b) - dot(a, b) * dot(a, b))) <= 9 * kRounding);
        REQUIRE(cross(b, a) == -c);
        // ICN Eq. 1: cross(a, b) · v = det[v | a | b], computed by the rule of Sarrus.
        const double det = v[0] * a[1] * b[2] + a[0] * b[1] * v[2] + b[0] * v[1] * a[2] - b[0] * a[1] * v[2] -
                           v[0] * b[1] * a[2] - a[0] * v[1] * b[2];
        REQUIRE(std::abs(dot(c, v) - det) <= kRounding);
    }
}

TEST_CASE("cross: agrees with reference values in three dimensions", "[math]") {
    const auto file = reference("dfvn_cross.json");
    int rows = 0;
    for (const auto& row : file.at("rows")) {
        if (row.at("n") != 3) continue;
        ++rows;
        CAPTURE(row.at("id").get<int>());
        const Vec3d c = cross(vec(row["v_f64"][0]), vec(row["v_f64"][1])), expected = vec(row["cross_f64"]);
        // The inputs are rounded rationals of at most 10: two products of at most 100, each with three rounding errors.
        for (int i = 0; i < 3; ++i) CHECK(std::abs(c[i] - expected[i]) <= 6 * 100 * 0x1p-53);
    }
    CHECK(rows > 0);
}

TEST_CASE("Matrix: product and transpose and application to vectors", "[math]") {
    const Matrix3 quarterTurn{{Vec3d{{0, -1, 0}}, Vec3d{{1, 0, 0}}, Vec3d{{0, 0, 1}}}}; // about z
    CHECK(quarterTurn * Vec3d{{1, 0, 0}} == Vec3d{{0, 1, 0}});
    CHECK(transpose(quarterTurn) * Vec3d{{0, 1, 0}} == Vec3d{{1, 0, 0}});
    CHECK(quarterTurn * transpose(quarterTurn) == Matrix3{});
    for (uint64_t k = 0; k < 100; ++k) {
        const Matrix3 a = randomMatrix(2 * k), b = randomMatrix(2 * k + 1);
        const Vec3d v = randomPoint(cube(1), 9, k), w = randomPoint(cube(1), 10, k);
        CAPTURE(k);
        REQUIRE(a * Matrix3{} == a);
        REQUIRE(Matrix3{} * a == a);
        REQUIRE(transpose(transpose(a)) == a);
        // Entries are below 2: sums of 9 products below 4.
        REQUIRE(length((a * b) * v - a * (b * v)) <= 9 * 4 * 4 * 0x1p-53);
        REQUIRE(std::abs(dot(a * v, w) - dot(v, transpose(a) * w)) <= 9 * 4 * 0x1p-53);
    }
}

TEST_CASE("Box: size and centre and containment and padding", "[math]") {
    const Box box{{{-1, 0, 2}}, {{3, 1, 4}}};
    CHECK(box.size() == Vec3d{{4, 1, 2}});
    CHECK(box.center() == Vec3d{{1, 0.5, 3}});
    CHECK(box.contains(box.lower));
    CHECK(box.contains(box.upper));
    for (int axis = 0; axis < 3; ++axis) {
        Vec3d below = box.center(), above = below;
        below[axis] = std::nextafter(box.lower[axis], -10);
        above[axis] = std::nextafter(box.upper[axis], 10);
        CAPTURE(axis);
        CHECK_FALSE(box.contains(below));
        CHECK_FALSE(box.contains(above));
    }
    const Box padded = box.padded(0.5);
    CHECK(padded.lower == Vec3d{{-1.5, -0.5, 1.5}});
    CHECK(padded.upper == Vec3d{{3.5, 1.5, 4.5}});
    CHECK(box.finite());
    for (const double bad : {std::numeric_limits<double>::infinity(), std::nan("")})
        for (int axis = 0; axis < 3; ++axis) {
            Box low = box, high = box;
            low.lower[axis] = -bad;
            high.upper[axis] = bad;
            CAPTURE(bad, axis);
            CHECK_FALSE(low.finite());
            CHECK_FALSE(high.finite());
        }
}

TEST_CASE("Matrix: rectangular matrices map columns to rows", "[math]") {
    const Matrix<2, 3> a{{Vec3d{{1, 2, 3}}, Vec3d{{-1, 0, 5}}}};
    CHECK(a * Vec3d{{1, 1, 2}} == Vec<double, 2>{{9, 9}});
    const Matrix<3, 2> t = transpose(a);
    CHECK(t[2] == Vec<double, 2>{{3, 5}});
    CHECK(transpose(t) == a);
    const Matrix<2, 2> gram = a * t;
    CHECK(gram[0] == Vec<double, 2>{{14, 14}});
    CHECK(gram[1] == Vec<double, 2>{{14, 26}});
    // The default matrix takes the first coordinates, or appends zeros.
    CHECK(Matrix<2, 5>{} * Vec<double, 5>{{1, 2, 3, 4, 5}} == Vec<double, 2>{{1, 2}});
    CHECK(Matrix<4, 2>{} * Vec<double, 2>{{1, 2}} == Vec<double, 4>{{1, 2, 0, 0}});
    CHECK(a * Matrix<3, 3>{} == a);
    CHECK(Matrix<2, 2>{} * a == a);
    STATIC_REQUIRE(Matrix<1, 3>{} * Vec3d{{7, 8, 9}} == Vec<double, 1>{{7}});
    for (uint64_t k = 0; k < 100; ++k) {
        Matrix<2, 5> b;
        Matrix<5, 3> c;
        for (uint64_t i = 0; i < 2; ++i) b.rows[i] = randomPoint(cube<5>(1), 20, 2 * k + i);
        for (uint64_t i = 0; i < 5; ++i) c.rows[i] = randomPoint(cube<3>(1), 21, 5 * k + i);
        const Vec3d v = randomPoint(cube(1), 22, k);
        const Vec<double, 2> w = randomPoint(cube<2>(1), 23, k);
        CAPTURE(k);
        // Sums of 15 and of 30 products of numbers below 1.
        REQUIRE(length((b * c) * v - b * (c * v)) <= 2 * 15 * 6 * 0x1p-53);
        REQUIRE(std::abs(dot((b * c) * v, w) - dot(c * v, transpose(b) * w)) <= 30 * 8 * 0x1p-53);
        REQUIRE(transpose(b * c) == transpose(c) * transpose(b));
    }
}

TEMPLATE_TEST_CASE_SIG("BoxN: behaves in every dimension as in three", "[math]", ((int N), N), 1, 2, 5) {
    BoxN<N> box;
    for (int axis = 0; axis < N; ++axis) {
        box.lower[axis] = -axis - 1;
        box.upper[axis] = 2 * axis + 1;
    }
    for (int axis = 0; axis < N; ++axis) {
        CAPTURE(N, axis);
        CHECK(box.size()[axis] == 3 * axis + 2);
        CHECK(box.center()[axis] == 0.5 * axis);
        CHECK(box.padded(2).lower[axis] == -axis - 3);
        CHECK(box.padded(2).upper[axis] == 2 * axis + 3);
        Vec<double, N> out = box.center();
        out[axis] = std::nextafter(box.upper[axis], 1e9);
        CHECK_FALSE(box.contains(out));
        out[axis] = std::nan(""); // not a position
        CHECK_FALSE(box.contains(out));
        BoxN<N> open = box;
        open.upper[axis] = std::numeric_limits<double>::infinity();
        CHECK_FALSE(open.finite());
        CHECK(open.contains(box.center()));
    }
    CHECK(box.finite());
    CHECK((box.contains(box.lower) && box.contains(box.upper) && box.contains(box.center())));
    for (const auto& p : randomPoints(box, 100, 24)) CHECK(box.contains(p));
    // With its corners swapped, a box is empty.
    CHECK_FALSE(BoxN<N>{box.upper, box.lower}.contains(box.center()));
    CHECK(BoxN<N>{}.contains(Vec<double, N>{}));
}
