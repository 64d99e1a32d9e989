// SPDX-License-Identifier: Apache-2.0
#include "curlew/math/Rotation.h"
#include "support/Points.h"

#include <numbers>

using namespace curlew;
using namespace curlew::test;

TEST_CASE("rotationVector: is the inverse of rotationBy up to half a turn", "[math]") {
    for (uint64_t k = 0; k < 200; ++k) {
        const Vec3d axis = normalized(randomPoint(cube(1), 1, k));
        for (const double left : {3.0, 1.0, 1e-3, 2e-6, 9e-7, 5e-7, 1e-8, 1e-12}) {
            const double angle = std::numbers::pi - left;
            CAPTURE(axis, left);
            const Matrix3 R = rotationBy(axis * angle);
            const Vec3d w = rotationVector(R);
            CHECK(length(w) == Approx(angle).epsilon(1e-14));
            CHECK(dot(w, axis) > 0);
            CHECK(length(w - axis * angle) < 1e-9); // rounding / left is largest where both formulas meet
            const Matrix3 again = rotationBy(w);
            for (int row = 0; row < 3; ++row) CHECK(length(again[row] - R[row]) < 1e-9);
        }
        const Vec3d half = rotationVector(rotationBy(axis * std::numbers::pi));
        CHECK(std::abs(dot(half, axis)) == Approx(std::numbers::pi)); // either direction
    }
    CHECK(rotationVector(Matrix3{}) == Vec3d{});
}
