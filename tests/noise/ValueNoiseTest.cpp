// SPDX-License-Identifier: Apache-2.0
#include "curlew/noise/ValueNoise.h"
#include "support/Points.h"

using namespace curlew;
using namespace curlew::test;

TEST_CASE("ValueNoise: values stay in 0 to 1 exactly and reach both ends", "[noise]") {
    double least = 1, most = 0;
    float leastFloat = 1, mostFloat = 0;
    for (uint64_t k = 0; k < 500000; ++k) {
        // Half of the points are close to faces, where the values of vertices are hardly blended.
        Vec<double, 2> p = randomPoint(cube<2>(300), 1, k);
        if (k % 2 == 0)
            for (double& x : p.c) x = std::round(x) + (x - std::round(x)) * 0.01;
        const ValueNoise<2> noise;
        const double value = noise.at<0, double>(p).value;
        const float single = noise.at<0, float>(p).value;
        least = std::min(least, value);
        most = std::max(most, value);
        leastFloat = std::min(leastFloat, single);
        mostFloat = std::max(mostFloat, single);
    }
    CAPTURE(least, most, leastFloat, mostFloat);
    CHECK(least >= 0);
    CHECK(most <= 1);
    CHECK(leastFloat >= 0);
    CHECK(mostFloat <= 1);
    CHECK(least < 1e-4);
    CHECK(most > 1 - 1e-4);
}

TEST_CASE("ValueNoise: the gradient vanishes at the vertices", "[noise]") {
    const ValueNoise<3> noise;
    for (const auto& p : randomPoints(cube(100), 100, 2)) {
        const Vec3d vertex{{std::floor(p[0]), std::floor(p[1]), std::floor(p[2])}};
        CAPTURE(vertex);
        const auto jet = noise.at<1, double>(vertex);
        CHECK(jet.gradient == Vec3d{});
        // One of 256 values.
        CHECK(std::abs(jet.value * 255 - std::round(jet.value * 255)) < 1e-13 * 255);
    }
}
