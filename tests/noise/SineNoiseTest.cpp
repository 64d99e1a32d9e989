// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/noise/SineNoise.h"
#include "support/FiniteDifference.h"

#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

constexpr double kTurn = 2 * std::numbers::pi;

/// Returns the mean of g gᵀ, divided by N 4π² |nu|² / 2 / M² per wave. It is the identity if all directions are
/// equivalent.
template <int N>
Matrix<N, N> isotropy(const SineNoise<N>& noise) {
    constexpr size_t kCount = 20000;
    Matrix<N, N> mean;
    for (auto& row : mean.rows) row = {};
    for (const auto& p : randomPoints(cube<N>(1e4), kCount, 1)) {
        const auto g = noise.template at<1, double>(p).gradient;
        for (int i = 0; i < N; ++i) mean[i] += g * (g[i] / kCount);
    }
    double trace = 0;
    for (int i = 0; i < N; ++i) trace += mean[i][i];
    for (auto& row : mean.rows) row *= N / trace;
    return mean;
}

} // namespace

TEMPLATE_TEST_CASE_SIG("SineNoise: a single wave is a plane wave of wavelength about 1", "[noise]", ((int N), N), 1, 2,
                       3, 4, 5, 6, 7) {
    // n = sin(k·x + phase): its Hessian is -k kᵀ n, and n² + |∇n|²/|k|² = 1.
    const uint64_t seed = GENERATE(0, 1, 2, 3);
    const SineNoise<N> noise({.waves = 1, .seed = seed});
    CAPTURE(N, seed);
    WorstN<N> worst;
    double waveNumber = 0;
    for (const auto& p : randomPoints(cube<N>(100), 100, 2)) {
        const auto jet = noise.template at<2, double>(p);
        if (std::abs(jet.value) < 0.1) continue;
        double laplacian = 0;
        for (int i = 0; i < N; ++i) laplacian += jet.hessian(i, i);
        const double k2 = -laplacian / jet.value;
        if (waveNumber == 0) waveNumber = std::sqrt(k2);
        // A few roundings, ten times larger after the division by the value.
        worst.see(std::abs(std::sqrt(k2) / waveNumber - 1), p);
        worst.see(std::abs(jet.value * jet.value + dot(jet.gradient, jet.gradient) / k2 - 1), p);
    }
    CAPTURE(worst.where);
    CHECK(worst.value < 1e-13);
    CHECK(waveNumber >= 0.75 * kTurn);
    CHECK(waveNumber <= 1.25 * kTurn);
}

TEMPLATE_TEST_CASE_SIG("SineNoise: even a few waves are isotropic", "[noise]", ((int N), N), 2, 3, 4, 5, 6, 7) {
    const int waves = GENERATE(8, 16, 64);
    const uint64_t seed = GENERATE(0, 1);
    CAPTURE(N, waves, seed);
    const auto mean = isotropy(SineNoise<N>({.waves = waves, .seed = seed}));
    WorstN<1> worst;
    for (int i = 0; i < N; ++i)
        for (int j = 0; j < N; ++j) worst.see(std::abs(mean[i][j] - (i == j)), {});
    // Wave numbers within 1 ± 1/4 weight the directions by their squares, and 20000 samples add 0.03. Random directions
    // would deviate by 1 for 8 waves in 7D, and by 0.6 in 3D.
    CHECK(worst.value < (waves == 8 ? 0.5 : waves == 16 ? 0.3 : 0.15));
}

TEST_CASE("SineNoise: has the mean square of independent sines", "[noise]") {
    const int waves = GENERATE(1, 2, 8, 64);
    CAPTURE(waves);
    const SineNoise<3> noise({.waves = waves});
    double mean = 0, square = 0, slope = 0;
    constexpr size_t kCount = 100000;
    for (const auto& p : randomPoints(cube(1e4), kCount, 3)) {
        const auto jet = noise.at<1, double>(p);
        mean += jet.value / kCount;
        square += jet.value * jet.value / kCount;
        slope += dot(jet.gradient, jet.gradient) / kCount;
    }
    // 4 sigma. The square of a nearly normal variable has a standard deviation of sqrt 2 times its mean.
    CHECK(std::abs(mean) < 4 * std::sqrt(0.5 / waves / kCount));
    CHECK(std::abs(square * 2 * waves - 1) < 4 * std::sqrt(2.0 / kCount));
    // |nu|² is between 9/16 and 25/16. Its mean for many waves is 1 + 1/48.
    CHECK(slope / square > 9 * kTurn * kTurn / 16 * 0.97);
    CHECK(slope / square < 25 * kTurn * kTurn / 16 * 1.03);
    if (waves == 64) CHECK(std::abs(slope / square / (kTurn * kTurn) - 1) < 0.08);
}

TEST_CASE("SineNoise: with a period of 1 is never constant", "[noise]") {
    // Each wave has at least one whole cycle along some axis: the mean square is that of sines, and the mean is zero.
    for (uint64_t seed = 0; seed < 20; ++seed) {
        const SineNoise<7> noise({.period = {{1, 1, 1, 1, 1, 1, 1}}, .waves = 1, .seed = seed});
        CAPTURE(seed);
        double steepest = 0;
        for (const auto& p : randomPoints(cube<7>(1), 20, seed))
            steepest = std::max(steepest, length(noise.at<1, double>(p).gradient));
        CHECK(steepest > 0.5 * kTurn);
    }
}

TEST_CASE("SineNoise: a long period on one axis barely changes the waves", "[noise]") {
    // Wave vectors move by at most half a cycle per period, which is 1/2000 along this axis.
    const SineNoise<2> plain({.seed = 3}), tiled({.period = {{0, 1000}}, .seed = 3});
    WorstN<2> worst;
    for (const auto& p : randomPoints(cube<2>(1), 1000, 4))
        worst.see(std::abs(plain.at<0, double>({{p[0], std::abs(p[1])}}).value -
                           tiled.at<0, double>({{p[0], std::abs(p[1])}}).value),
                  p);
    CAPTURE(worst.where);
    CHECK(worst.value <= kTurn * 0.0005);
    CHECK(worst.value > 0);
}

TEST_CASE("SineNoise: a number of waves out of range is rejected", "[noise]") {
    const int waves = GENERATE(-1, 0, 65, 1 << 30);
    CHECK_THROWS_AS(SineNoise<3>({.waves = waves}), ValueError);
    CHECK_THROWS_WITH(SineNoise<3>({.waves = waves}), Catch::ContainsSubstring(std::to_string(waves)));
    CHECK_NOTHROW(SineNoise<3>({.waves = 64}));
}
