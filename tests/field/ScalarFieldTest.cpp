// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/Algebra.h"
#include "curlew/field/Bound.h"
#include "curlew/field/NoiseField.h"
#include "curlew/field/ScalarField.h"
#include "support/FiniteDifference.h"
#include "support/Formula.h"

using namespace curlew;
using namespace curlew::test;

namespace {

/// A model that works on batches, has a range and counts its calls.
struct Counting {
    int* calls;
    template <int Order, class T>
    void evalBatch(const PointBatch& points, JetBatch<T, Order>& jets) const {
        ++*calls;
        for (int i = 0; i < points.size; ++i) jets.set(i, Jet<T, 3, Order>::variable(static_cast<T>(points[i][1]), 1));
    }
    Interval range() const { return Interval::within(42); }
};

} // namespace

TEST_CASE("ScalarField: accepts pointwise and batch models", "[field]") {
    const ScalarField pointwise = formula([](const auto& x) { return x[0] * x[1]; });
    CHECK(pointwise.at<0>({{2, 3, 4}}).value == 6);
    CHECK(pointwise.at<1>({{2, 3, 4}}).gradient == Vec3d{{3, 2, 0}});
    CHECK(pointwise.at<2>({{2, 3, 4}}).hessian(0, 1) == 1);
    CHECK(std::isinf(pointwise.range().maxAbs()));

    int calls = 0;
    const ScalarField batched(Counting{&calls});
    CHECK(batched.range().maxAbs() == 42);
    PointBatch points;
    for (const Vec3d& p : randomPoints(cube(1), kBatch, 1)) points.push(p);
    JetBatch<double, 1> jets;
    batched.eval(points, jets);
    CHECK(calls == 1);
    for (int i = 0; i < kBatch; ++i) CHECK(jets[i].value == points[i][1]);
    const ScalarField copy = batched; // shares the model
    CHECK(copy.at<1>({{1, 2, 3}}).value == 2);
    CHECK(calls == 2);
}

TEST_CASE("ScalarField: every field gives the same bits for any derivative order and batch size", "[field]") {
    const ScalarField noise = noiseField<Psrd3>({.seed = 3}, {.frequency = 2.3, .octaves = 3});
    struct Case {
        const char* name;
        ScalarField field;
    };
    const std::vector<Case> cases{
        {"noise", noise},
        {"sum", noise + rampField({{1, 2, 3}})},
        {"product", noise * sphereSdf(0.7).distance},
        {"scaled", -0.3 * noise},
        {"placed", placed(noise, {.offset = {{1, 2, 3}}, .rotate = {{10, 20, 30}}, .scale = {{1, 2, 0.5}}})},
        {"box", boxSdf({{1, 0.8, 1.2}}, 0.1).distance},
        {"torus", torusSdf(0.6, 0.2).distance},
        {"capsule", capsuleSdf(0.6, 0.3).distance},
        {"gyroid", gyroidSdf(0.7, 0.1).distance},
        {"bounded", bounded(noise, {.sdf = sphereSdf(0.8), .side = Side::both, .width = 0.2})},
        {"product bounded", productBounded(noise, sphereSdf(0.8), 0.3)},
        {"value noise", noiseField<ValueNoise<3>>({.seed = 1}, {.octaves = 2})},
        {"Perlin noise", noiseField<PerlinNoise<3>>({}, {.frequency = 3})},
        {"gradient noise", noiseField<GradientNoise<3>>({}, {.frequency = 3, .billow = 0.1})},
        {"simplex noise", noiseField<SimplexNoise<3>>({.power = 3}, {.frequency = 3})},
        {"advected", noiseField<PerlinNoise<3>>({}, {.frequency = 3, .octaves = 3, .warp = 0.05})},
        {"difference and quotient", (noise - rampField({{1, 2, 3}})) / (noise + constantField(2))},
        {"smooth minimum", smoothMin(noise, sphereSdf(0.6).distance, 0.3)},
        {"smooth maximum", smoothMax(noise, sphereSdf(0.6).distance, 0.3)},
        {"clipped", clipped(noise, 0.5)},
        {"projected",
         projected(noiseField<Psrd2>({}, {.frequency = 2}), Matrix<2, 3>{{Vec3d{{0, 0.3, 1}}, Vec3d{{1, 0, 0.7}}}})},
        {"lifted", lifted<3>(noiseField<SimplexNoise<4>>({}, {.frequency = 2}), {noise})},
        {"height", heightField<3>(noiseField<Psrd2>())},
        {"displaced", displaced(noise, noiseField<ValueNoise<3>>({}, {.frequency = 2}), 0.05)},
    };
    for (const auto& [name, field] : cases)
        for (uint64_t batch = 0; batch < 20; ++batch) {
            PointBatch points;
            for (uint64_t k = 0; k < 1 + (batch * 7) % kBatch; ++k) points.push(randomPoint(cube(1), batch, k));
            JetBatch<double, 0> values;
            JetBatch<double, 1> first;
            JetBatch<double, 2> second;
            JetBatch<float, 0> floatValues;
            JetBatch<float, 1> floatFirst;
            field.eval(points, values);
            field.eval(points, first);
            field.eval(points, second);
            JetBatch<double, 3> third;
            const bool hasThird = name != std::string("displaced") && name != std::string("advected");
            if (hasThird) field.eval(points, third);
            field.eval(points, floatValues);
            field.eval(points, floatFirst);
            for (int i = 0; i < points.size; ++i) {
                const Vec3d p = points[i];
                CAPTURE(name, p);
                const auto jet = second[i];
                if (values[i].value != jet.value || first[i].value != jet.value || first[i].gradient != jet.gradient)
                    FAIL("orders differ");
                if (floatValues[i].value != floatFirst[i].value) FAIL("orders differ in float");
                if (hasThird && difference(truncated<2>(third[i]), jet) != 0) FAIL("the third order differs");
                if (difference(field.at<2>(p), jet) != 0) FAIL("a point alone differs from a batch");
                // About a hundred roundings of values near 1, with an amplitude of at most 3.
                if (std::abs(double(floatValues[i].value) - jet.value) > 1e-4) FAIL("float differs");
            }
        }
}

TEST_CASE("ScalarField: evaluating an empty batch does nothing", "[field]") {
    PointBatch none;
    JetBatch<double, 2> jets;
    jets.c[0][0] = 7;
    noiseField<Psrd3>().eval(none, jets);
    bounded(noiseField<Psrd3>(), {.sdf = sphereSdf(1)}).eval(none, jets);
    CHECK(jets.c[0][0] == 7);
}
