// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/Formula.h"
#include "support/FiniteDifference.h"

using namespace curlew;
using namespace curlew::test;

TEST_CASE("formulaField: gives derivatives of every order", "[field]") {
    const ScalarField field = formulaField([](const auto& x) { return x[0] * x[0] * x[1] + x[2]; });
    const Vec3d p{{2, 3, 5}};
    CHECK(field.at<0>(p).value == 17);
    CHECK(field.at<1>(p).gradient == Vec3d{{12, 4, 1}});
    CHECK(field.at<2>(p).hessian(0, 0) == 6);
    CHECK(field.at<2>(p).hessian(0, 1) == 4);
    CHECK(field.at<3>(p).third(0, 0, 1) == 2);
    CHECK(field.at<3>(p).third(0, 1, 1) == 0);
    CHECK(field.at<1, float>(p).value == 17);
    CHECK(field.at<1, float>(p).gradient == Vec<float, 3>{{12, 4, 1}});
    CHECK(field.range() == Interval{}); // the range is unknown
}

TEST_CASE("formulaField: constants can be passed as jets", "[field]") {
    const auto field = formulaField<2>([](const auto& x, auto k) { return k(2.5) * x[1] - k(0.1); });
    CHECK(field.at<0>({{7, 2}}).value == 2.5 * 2 - 0.1);
    CHECK(field.at<1>({{7, 2}}).gradient == Vec<double, 2>{{0, 2.5}});
    // In float, constants are rounded once.
    CHECK(field.at<0, float>({{7, 2}}).value == 2.5f * 2.0f - 0.1f);
    const auto constant = formulaField<2>([](const auto&, auto k) { return k(3); });
    CHECK(difference(constant.at<3>({{7, 2}}), Jet<double, 2, 3>(3.0)) == 0);
}

TEMPLATE_TEST_CASE_SIG("formulaField: derivatives agree with central differences in every dimension", "[field]",
                       ((int N), N), 1, 2, 3, 4, 5, 6, 7) {
    const auto field = formulaField<N>([](const auto& x, auto k) {
        auto sum = sin(x[0]);
        for (int i = 1; i < N; ++i) sum += cos(x[i] * k(1.5) - x[i - 1]) * x[0];
        return sum;
    });
    const auto points = randomPoints(cube<N>(1), 100, 1);
    // A sum of N terms, each with a factor of up to 1 and third derivatives of at most 1.5³ + 3 · 1.5² times 1 … 2.
    requireDerivatives(field, points, 0x1p-9, 20.0 * N);
    requireThirdDerivatives(field, points, 0x1p-9);
}
