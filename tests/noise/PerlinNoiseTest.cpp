// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/noise/PerlinNoise.h"
#include "support/FiniteDifference.h"

#include <algorithm>

using namespace curlew;
using namespace curlew::test;

namespace {

/// Returns the greatest value that a field with these gradients can have at s in a cell: each corner takes its greatest
/// ramp.
template <int N>
double most(const std::vector<Vec<double, N>>& gradients, const Vec<double, N>& s) {
    return blendCorners<0>(s,
                           [&](size_t k) {
                               double best = 0;
                               for (const auto& g : gradients) best = std::max(best, cornerRamp<0>(g, s, k).value);
                               return Jet<double, N, 0>(best);
                           })
        .value;
}

} // namespace

TEST_CASE("PerlinNoise: reference gradients give the published value of improved noise", "[noise]") {
    // Perlin's own test value for ports.
    const PerlinNoise<3> noise({.gradients = PerlinGradients::reference});
    CHECK(std::abs(noise.at<0, double>({{3.14, 42, 7}}).value - 0.13691995878400012) < 1e-15);
    int differs = 0;
    for (const auto& p : randomPoints(cube(100), 1000, 1))
        differs += noise.at<0, double>(p).value != PerlinNoise<3>().at<0, double>(p).value;
    // One corner in eight has one of the two entries that were swapped: 1 - (7/8)^8 of all cells.
    CHECK(differs > 550);
    CHECK(differs < 750);
}

TEST_CASE("PerlinNoise: reference gradients are available in 3D only", "[noise]") {
    CHECK_THROWS_AS(PerlinNoise<1>({.gradients = PerlinGradients::reference}), ValueError);
    CHECK_THROWS_WITH(PerlinNoise<2>({.gradients = PerlinGradients::reference}), Catch::ContainsSubstring("3D only"));
}

TEST_CASE("PerlinNoise: the bound is the maximum over all choices of vertex gradients", "[noise]") {
    std::vector<Vec<double, 1>> in1{{{2}}, {{-2}}};
    std::vector<Vec<double, 2>> in2;
    std::vector<Vec3d> in3;
    for (int a = -1; a <= 1; ++a)
        for (int b = -1; b <= 1; ++b) {
            const double x = a, y = b, l = std::hypot(x, y);
            if (l > 0) in2.push_back({{x * std::sqrt(2.0) / l, y * std::sqrt(2.0) / l}});
            for (int c = -1; c <= 1; ++c)
                if (a * a + b * b + c * c == 2) in3.push_back({{x, y, double(c)}});
        }
    double most1 = 0, most2 = 0, most3 = 0;
    constexpr int kSteps = 40;
    const auto step = [](int i) { return 0.5 * i / kSteps; }; // half the cell, since it is symmetric
    for (int i = 0; i <= kSteps; ++i) {
        most1 = std::max(most1, most<1>(in1, {{step(i)}}));
        for (int j = 0; j <= kSteps; ++j) {
            most2 = std::max(most2, most<2>(in2, {{step(i), step(j)}}));
            for (int k = 0; k <= kSteps; ++k) most3 = std::max(most3, most<3>(in3, {{step(i), step(j), step(k)}}));
        }
    }
    CHECK(std::abs(most1 - 1) < 1e-15);
    CHECK(std::abs(most2 - 1) < 1e-15);
    CAPTURE(most3);
    CHECK(most3 > 1.036);
    // The maximum, found by repeatedly refining such a grid.
    const double exact = most<3>(in3, {{0.3552566956, 0.5, 0.4814922107}});
    CHECK(std::abs(exact - 1.036353811211803) < 1e-12);
    CHECK(most3 <= exact);
    CHECK(exact <= PerlinNoise<3>::kBound);
    CHECK(exact > 0.9999 * PerlinNoise<3>::kBound);
}

TEST_CASE("PerlinNoise: values come close to the bound", "[noise]") {
    double most1 = 0, most2 = 0, most3 = 0;
    for (uint64_t k = 0; k < 300000; ++k) {
        most1 = std::max(most1, std::abs(PerlinNoise<1>().at<0, double>(randomPoint(cube<1>(128), 2, k)).value));
        most2 = std::max(most2, std::abs(PerlinNoise<2>().at<0, double>(randomPoint(cube<2>(128), 2, k)).value));
        most3 = std::max(most3, std::abs(PerlinNoise<3>().at<0, double>(randomPoint(cube<3>(128), 2, k)).value));
    }
    CAPTURE(most1, most2, most3);
    CHECK(most1 > 0.999);
    CHECK(most2 > 0.97);
    CHECK(most3 > 0.9);
}
