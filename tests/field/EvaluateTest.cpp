// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/Evaluate.h"
#include "support/Catch.h"
#include "support/Points.h"
#include "support/Polynomial.h"

using namespace curlew;
using namespace curlew::test;

TEST_CASE("evaluateValues and evaluateGradients: agree with evaluation of single points", "[field]") {
    const ScalarField field = polynomial("x0**2*x1 + 3*x2");
    const size_t count = GENERATE(size_t{0}, size_t{1}, size_t{64}, size_t{65}, size_t{1000});
    const auto positions = randomPoints(cube(1), count, 1);
    std::vector<double> values(count);
    std::vector<float> rounded(count);
    std::vector<Vec3d> gradients(count);
    evaluateValues(field, positions, values);
    evaluateValues(field, positions, std::span<float>(rounded));
    evaluateGradients(field, positions, gradients);
    for (size_t k = 0; k < count; ++k) {
        CAPTURE(count, k);
        const auto jet = field.at<1>(positions[k]);
        CHECK(values[k] == jet.value);
        CHECK(rounded[k] == field.at<0, float>(positions[k]).value);
        CHECK(gradients[k] == jet.gradient);
    }
}

TEST_CASE("evaluateValues and evaluateGradients: mismatched sizes and cancellation are refused", "[field]") {
    const ScalarField field = polynomial("x0");
    const auto positions = randomPoints(cube(1), 100, 1);
    std::vector<float> values(99);
    CHECK_THROWS_AS(evaluateValues(field, positions, values), ValueError);
    std::vector<Vec3f> gradients(101);
    CHECK_THROWS_AS(evaluateGradients(field, positions, gradients), ValueError);
    values.resize(100);
    CHECK_THROWS_AS(evaluateValues(field, positions, values, {.report = {}, .cancelled = [] { return true; }}),
                    Interrupted);
}
