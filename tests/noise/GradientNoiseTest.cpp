// SPDX-License-Identifier: Apache-2.0
#include "curlew/noise/GradientNoise.h"
#include "support/Points.h"
#include "support/Samples.h"

using namespace curlew;
using namespace curlew::test;

TEST_CASE("GradientNoise: vertex gradients are those of the integer hash", "[noise]") {
    // At a vertex, only its own ramp contributes. By hand: at the origin n is 0, then 1376312589 = 0x5208dd0d, which is
    // masked to 0x0208dd0d.
    const double g = -1 + 2.0 * 0x0208dd0d / 0x0fffffff;
    CHECK(difference(GradientNoise<2>().at<1, double>({}), [&] {
              Jet<double, 2, 1> jet;
              jet.gradient = {{g, g}};
              return jet;
          }()) < 1e-15);
    CHECK(std::abs(GradientNoise<3>().at<1, double>({}).gradient[2] - g) < 1e-15);
    // In 2D the noise is the plane with third coordinate 0, without the third component of the gradients.
    for (const auto& p : randomPoints(cube<2>(1e6), 100, 1)) {
        const Vec<double, 2> v{{std::floor(p[0]), std::floor(p[1])}};
        CAPTURE(v);
        const auto flat = GradientNoise<2>().at<1, double>(v).gradient;
        const auto full = GradientNoise<3>().at<1, double>({{v[0], v[1], 0}}).gradient;
        CHECK(flat == Vec<double, 2>{{full[0], full[1]}});
    }
}

TEST_CASE("GradientNoise: without a period repeats after 2^28 cells and not earlier", "[noise]") {
    const GradientNoise<3> noise({.seed = GENERATE(uint64_t{0}, uint64_t{6})});
    Worst repeated;
    int differs = 0;
    for (uint64_t k = 0; k < 1000; ++k) {
        const Vec3d p = dyadic(randomPoint(cube(1000), 2, k));
        const auto jet = noise.at<2, double>(p);
        repeated.see(difference(jet, noise.at<2, double>(p + Vec3d{{0x1p28, -0x1p28, 0x1p33}})), p);
        differs += difference(jet, noise.at<2, double>(p + Vec3d{{0x1p27, 0, 0}})) > 0.1;
    }
    CAPTURE(repeated.where);
    CHECK(repeated.value == 0);
    CHECK(differs > 900);
}

TEST_CASE("GradientNoise: vertex gradients are uniform in a cube", "[noise]") {
    // Independent uniform components: mean 0, mean square 1/3, no correlation. Limits are 4 sigma.
    constexpr int kCount = samples(100000);
    const GradientNoise<3> noise;
    Vec3d mean;
    Matrix3 square{{Vec3d{}, Vec3d{}, Vec3d{}}};
    for (uint64_t k = 0; k < kCount; ++k) {
        Vec3d v = randomPoint(cube(1e6), 3, k);
        for (double& x : v.c) x = std::floor(x);
        const Vec3d g = noise.at<1, double>(v).gradient;
        mean += g * (1.0 / kCount);
        for (int i = 0; i < 3; ++i) square[i] += g * (g[i] / kCount);
    }
    CAPTURE(mean, square[0], square[1], square[2]);
    for (int i = 0; i < 3; ++i) {
        CHECK(std::abs(mean[i]) < 4 * std::sqrt(1.0 / 3 / kCount));
        for (int j = 0; j < 3; ++j)
            CHECK(std::abs(square[i][j] - (i == j ? 1.0 / 3 : 0)) < 4 * (i == j ? 0.3 : 1.0 / 3) / std::sqrt(kCount));
    }
}
