// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/Formula.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flow.h"
#include "support/FlowChecks.h"
#include "support/Flows.h"

using namespace curlew;
using namespace curlew::test;

namespace {

/// Not a distance: the length of its gradient varies along each level set.
template <int N>
ScalarFieldN<N> ellipsoids() {
    return formulaField<N>([](const auto& x, const auto& k) {
        auto sum = x[0] * x[0] + k(0.3) * x[0] * x[1];
        for (int i = 1; i < N; ++i) sum += k(1.0 + i) * x[i] * x[i];
        return sum;
    });
}

/// A flow whose last potential is ellipsoids().
template <int N>
FlowN<N> onEllipsoids() {
    typename FlowN<N>::Potentials potentials = flowOf<SineNoise<N>>({}, {.frequency = 0.5}).potentials();
    potentials.back() = ellipsoids<N>();
    return FlowN<N>(std::move(potentials)).onLevelSets();
}

/// The divergence within the level sets of the last potential F, of which n is the normal: the trace of the derivative
/// minus n · D n. Relative to the size of the derivative.
template <int N>
double divergenceWithin(const FlowN<N>& flow, const Vec<double, N>& p) {
    const auto gradient = flow.potentials().back().template at<1>(p).gradient;
    const auto n = gradient * (1 / length(gradient));
    const Matrix<N, N> derivative = flow.at(p).derivative;
    return std::abs(trace(derivative) - dot(n, derivative * n)) / frobenius(derivative);
}

template <int N>
void requireAreaPreserving() {
    const FlowN<N> flow = onEllipsoids<N>();
    FlowN<N> plain(flow.potentials());
    WorstN<N> divergence, across;
    double plainDivergence = 0;
    for (const auto& p : randomPoints(cube<N>(1), 2000, 5)) {
        const auto gradient = flow.potentials().back().template at<1>(p).gradient;
        const auto sample = flow.at(p);
        divergence.see(divergenceWithin(flow, p), p);
        across.see(std::abs(dot(sample.velocity, gradient)) / (length(gradient) * (1 + length(sample.velocity))), p);
        plainDivergence = std::max(plainDivergence, divergenceWithin(plain, p));
    }
    CAPTURE(N, divergence.value, divergence.where, across.value);
    // Relative to the derivative, which may be much smaller than the products in it.
    CHECK(divergence.value < 1e-9);
    CHECK(across.value < 1e-14);
    CHECK(plainDivergence > 0.1); // the divergence-free flow is not area-preserving
    CHECK(flow.preservesArea());
    CHECK(!flow.divergenceFree());
    CHECK(flow.hasTracks());
    requireJacobian(flow, cube<N>(1), 200, 3);
}

} // namespace

TEST_CASE("Flow: on level sets its divergence within them is zero, and it is tangent to them", "[flow]") {
    requireAreaPreserving<3>();
    requireAreaPreserving<4>();
}

TEST_CASE("Flow: on level sets batches and single positions agree in both precisions", "[flow]") {
    const Flow flow = onEllipsoids<3>();
    PointBatch points;
    while (!points.full()) points.push(randomPoint(cube(1), 8, static_cast<uint64_t>(points.size)));
    VecBatch<double> doubles;
    VecBatch<float> floats;
    flow.velocity(points, doubles);
    flow.velocity(points, floats);
    for (int i = 0; i < points.size; ++i) {
        const Vec3d expected = flow.at(points[i]).velocity;
        CAPTURE(points[i], expected);
        CHECK(length(doubles[i] - expected) <= 1e-14 * (1 + length(expected)));
        for (int axis = 0; axis < 3; ++axis)
            CHECK(std::abs(static_cast<double>(floats[i][axis]) - expected[axis]) <= 1e-5 * (1 + length(expected)));
    }
    // At the centre of the ellipsoids, the gradient is zero, and so is the velocity.
    CHECK(flow.at({}).velocity == Vec3d{});
}

TEST_CASE("Flow: the flow of a signed distance is the same on its level sets", "[flow]") {
    const ScalarField noise = noiseField<Psrd3>(), distance = sphereSdf(0.7).distance;
    const Flow plain(noise, distance), area = plain.onLevelSets();
    for (const auto& p : randomPoints(cube(1), 200, 4))
        CHECK(length(plain.at(p).velocity - area.at(p).velocity) <= 1e-14 * (1 + length(plain.at(p).velocity)));
}

TEST_CASE("Flow: only a flow of one term in at least three dimensions can be on level sets", "[flow]") {
    const Flow flow = flowOf<Psrd3>({});
    CHECK_THROWS_WITH((flow + flow).onLevelSets(), Catch::Matchers::ContainsSubstring("one term"));
    CHECK_THROWS_WITH(flow.normalized(1).onLevelSets(), Catch::Matchers::ContainsSubstring("normalised"));
    CHECK_THROWS_WITH(flow + flow.onLevelSets(), Catch::Matchers::ContainsSubstring("sum"));
    CHECK_THROWS_WITH(flowOf<Psrd2>({}).onLevelSets(), Catch::Matchers::ContainsSubstring("3 dimensions"));
    CHECK(!flow.onLevelSets().normalized(1).preservesArea());
}

TEST_CASE("Flow: withSpeed scales a flow on level sets", "[flow]") {
    const Flow flow = withSpeed(onEllipsoids<3>(), 2);
    CHECK(flow.preservesArea());
    CHECK(rmsOf(flow).speed == Approx(2).epsilon(1e-12));
}
