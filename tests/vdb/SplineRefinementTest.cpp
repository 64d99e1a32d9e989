// SPDX-License-Identifier: Apache-2.0
#include "../../src/vdb/SplineRefinement.h"
#include "support/Points.h"

using namespace curlew;

namespace {

/// An arbitrary coefficient of voxel (i, j, k).
double arbitrary(int i, int j, int k) {
    return test::randomPoint(test::cube(1), 5, static_cast<uint64_t>(((i + 50) * 100 + j + 50) * 100 + k + 50))[0];
}

/// Returns the spline with these coefficients at a position in voxels.
template <class Coefficient>
double splineAt(const Vec3d& p, const Coefficient& coefficient) {
    double sum = 0;
    std::array<int, 3> base;
    std::array<std::array<double, 4>, 3> w;
    for (size_t axis = 0; axis < 3; ++axis) {
        const double x = p[static_cast<int>(axis)], below = std::floor(x);
        base[axis] = static_cast<int>(below);
        w[axis] = cubicBSplineWeights(x - below, 0);
    }
    for (size_t i = 0; i < 4; ++i)
        for (size_t j = 0; j < 4; ++j)
            for (size_t k = 0; k < 4; ++k)
                sum += w[0][i] * w[1][j] * w[2][k] *
                       coefficient(base[0] + static_cast<int>(i) - 1, base[1] + static_cast<int>(j) - 1,
                                   base[2] + static_cast<int>(k) - 1);
    return sum;
}

} // namespace

TEST_CASE("SplineRefinement: the spline on smaller voxels is the same function", "[vdb]") {
    // Each remainder of three along each axis, on either side of 0.
    const int x = GENERATE(-4, 0, 5), y = GENERATE(-3, 1), z = GENERATE(-11, 7);
    const Vec<int, 3> first{{x, y, z}};
    const SplineRefinement::Block block = SplineRefinement::blockAt(first, arbitrary);
    constexpr int kEdge{SplineRefinement::kBlock};
    const auto refined = [&](int i, int j, int k) {
        const int n = ((i - x) * kEdge + j - y) * kEdge + k - z;
        return block[static_cast<size_t>(n)];
    };
    for (int n = 0; n < kEdge; ++n) {
        const Vec<int, 3> small{{x + n, y + (5 * n) % kEdge, z + (7 * n) % kEdge}};
        CHECK(SplineRefinement::at(small, arbitrary) == Approx(refined(small[0], small[1], small[2])).margin(1e-15));
    }
    double worst = 0;
    for (uint64_t k = 0; k < 200; ++k) {
        Vec3d p = test::randomPoint(test::cube(0.5 * (kEdge - 3)), 6, k);
        for (int axis = 0; axis < 3; ++axis) p[axis] += first[axis] + 0.5 * (kEdge - 1);
        const double ratio = SplineRefinement::kRatio;
        worst = std::max(worst, std::abs(splineAt(p, refined) - splineAt(p * (1 / ratio), arbitrary)));
    }
    CHECK(worst < 1e-14);
}
