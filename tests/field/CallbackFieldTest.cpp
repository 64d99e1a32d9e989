// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/CallbackField.h"
#include "curlew/field/NoiseField.h"
#include "support/Points.h"

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;

namespace {

/// A callback that evaluates a field, with its gradients times `factor`.
template <int N>
FieldCallback callbackOf(const ScalarFieldN<N>& field, double factor = 1) {
    return [field, factor](size_t count, const double* positions, double* values, double* gradients) {
        for (size_t k = 0; k < count; ++k) {
            Vec<double, N> p;
            for (size_t axis = 0; axis < N; ++axis) p[static_cast<int>(axis)] = positions[k * N + axis];
            const auto jet = field.template at<1>(p);
            values[k] = jet.value;
            for (size_t axis = 0; axis < N; ++axis)
                gradients[k * N + axis] = factor * jet.gradient[static_cast<int>(axis)];
        }
    };
}

template <int N>
void requireSame(const ScalarFieldN<N>& field) {
    const ScalarFieldN<N> called = callbackField<N>(callbackOf(field));
    for (const auto& p : randomPoints(cube<N>(1), 200, 3)) {
        const auto expected = field.template at<2>(p), found = called.template at<2>(p);
        CAPTURE(N, p);
        CHECK(found.value == expected.value);
        CHECK(found.gradient == expected.gradient);
        for (int i = 0; i < N; ++i)
            for (int j = 0; j < N; ++j) // differences over 2^-18 of the box: roundings of 1e-16 / 1e-5, and h²
                CHECK(std::abs(found.hessian(i, j) - expected.hessian(i, j)) < 1e-4);
        CHECK(called.template at<1, float>(p).value == static_cast<float>(expected.value));
    }
    CHECK_THROWS_WITH(called.template at<3>({}), ContainsSubstring("third"));
}

} // namespace

TEST_CASE("callbackField: has the values and gradients of the callback, in any dimension", "[field]") {
    requireSame<1>(noiseField<SineNoise<1>>());
    requireSame<2>(noiseField<SineNoise<2>>());
    requireSame<3>(noiseField<Psrd3>());
    requireSame<5>(noiseField<SineNoise<5>>());
}

TEST_CASE("callbackField: wrong gradients and values that are not finite are errors", "[field]") {
    const ScalarField noise = noiseField<Psrd3>();
    CHECK_THROWS_WITH(callbackField<3>(callbackOf(noise, 1.01)), ContainsSubstring("not those of its values"));
    CHECK_THROWS_WITH(callbackField<3>(callbackOf(noise, -1)), ContainsSubstring("differ"));
    CHECK_THROWS_WITH(callbackField<3>(callbackOf(noise, std::numeric_limits<double>::quiet_NaN())),
                      ContainsSubstring("gradient") && ContainsSubstring("finite"));
    CHECK_THROWS_WITH(callbackField<3>(nullptr), ContainsSubstring("no callback"));
    CHECK_THROWS_WITH(callbackField<3>(callbackOf(noise), Box{}), ContainsSubstring("box"));
    // A constant has no gradient; a kink is allowed.
    CHECK_NOTHROW(callbackField<1>([](size_t count, const double*, double* values, double* gradients) {
        for (size_t k = 0; k < count; ++k) values[k] = 3, gradients[k] = 0;
    }));
    // What the callback throws is passed on.
    CHECK_THROWS_WITH(callbackField<1>([](size_t, const double*, double*, double*) { throw ValueError("mine"); }),
                      ContainsSubstring("mine"));
}
