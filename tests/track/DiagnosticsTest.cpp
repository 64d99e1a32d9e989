// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Carried.h"
#include "curlew/flow/Flows.h"
#include "curlew/flow/Reshape.h"
#include "curlew/track/Advect.h"
#include "curlew/track/Diagnostics.h"
#include "curlew/track/Scatter.h"
#include "support/Catch.h"

using namespace curlew;

namespace {

Wall ball() { return {.sdf = sphereSdf(1), .side = Side::inside, .width = 0.25}; }

Flow contained() {
    return withSpeed(Flow(noiseField<Psrd3>({.seed = 1}, {.frequency = 2}),
                          bounded(noiseField<Psrd3>({.seed = 2}, {.frequency = 2}), ball()), Domain::of(ball())),
                     1);
}

/// A common error in implementing Eq. 13: it blends the gradients instead of the functions. The result is not the
/// gradient of any function.
struct BlendedGradients {
    ScalarField distance, noise;
    template <int Order, class T>
    Jet<T, 3, Order> at(const Vec3d& p) const {
        const auto d = distance.at<Order, T>(p), n = noise.at<Order, T>(p);
        const T alpha = std::clamp(-d.value / T(0.25), T(0), T(1));
        return d * (T(1) - alpha) + n * alpha;
    }
};

/// A field that is NaN for x > 0.5.
struct Holed {
    ScalarField field;
    template <int Order, class T>
    Jet<T, 3, Order> at(const Vec3d& p) const {
        return field.at<Order, T>(p) * (p[0] > 0.5 ? std::numeric_limits<T>::quiet_NaN() : T(1));
    }
};

} // namespace

TEST_CASE("diagnoseFlow: a contained flow has no divergence and no wall flux", "[track]") {
    const FlowDiagnostics check = diagnoseFlow(contained(), 20000);
    CHECK(check.divergence.trace < 1e-9);
    CHECK(check.divergence.traceBeyond <= check.divergence.trace);
    CHECK(check.wallFlux < 1e-6);
    CHECK(check.wallSamples > 1000);
    CHECK(check.rms.speed == Approx(1));
}

TEST_CASE("diagnoseFlow: detects a flow that crosses its wall", "[track]") {
    const Flow leaking(noiseField<Psrd3>({.seed = 1}, {.frequency = 2}),
                       noiseField<Psrd3>({.seed = 2}, {.frequency = 2}), Domain::of(ball()));
    CHECK(diagnoseFlow(leaking, 5000).wallFlux > 0.1);
}

TEST_CASE("diagnoseFlow: a flow that is NaN somewhere is not divergence-free", "[track]") {
    const ScalarField f = noiseField<Psrd3>({.seed = 1}, {.frequency = 2});
    const Flow holed(f, ScalarField(Holed{contained().g()}), Domain::of(ball()));
    const FlowDiagnostics check = diagnoseFlow(holed, 5000);
    CHECK(check.divergence.trace == std::numeric_limits<double>::infinity());
    CHECK(check.wallFlux == std::numeric_limits<double>::infinity());
    CHECK_FALSE(check.divergence.vanishes());
    CHECK_FALSE(check.divergence.byDifferences < 1e300);
}

TEST_CASE("diagnoseDivergence: detects a potential with a wrong gradient", "[track]") {
    const ScalarField noise = noiseField<Psrd3>({.seed = 2}, {.frequency = 2});
    const Flow wrong(noiseField<Psrd3>({.seed = 1}, {.frequency = 2}),
                     ScalarField(BlendedGradients{ball().sdf.distance, noise}), Domain::of(ball()));
    const DivergenceDiagnostics check = diagnoseDivergence(wrong, 20000);
    CHECK(check.byDifferences > 1e-2);
    CHECK(check.order().value() == Approx(0).margin(0.1)); // for any step of the differences
    CHECK_FALSE(check.vanishes());
}

TEST_CASE("diagnoseDivergence: differences of divergence-free flows vanish with their step", "[track]") {
    const auto psrd = [](uint64_t seed) { return noiseField<Psrd3>({.seed = seed}, {.frequency = 1.5}); };
    const auto sine = [](uint64_t seed) { return noiseField<SineNoise<3>>({.seed = seed}); };
    const auto bound = [&](const Wall& wall) { return Flow(psrd(1), bounded(psrd(2), wall), Domain::of(wall)); };
    const Wall around{.sdf = torusSdf(0.7, 0.3), .side = Side::outside, .width = 0.15};
    const Wall both{.sdf = sphereSdf(0.7), .side = Side::both, .width = 0.2};
    const auto plane = [](uint64_t seed) { return noiseField<Psrd2>({.seed = seed}); };
    const Flow large(sine(7), sine(8));
    const std::vector<std::pair<std::string, Flow>> flows{
        {"noise", Flow(psrd(1), psrd(2))},
        {"contained", contained()},
        {"around an obstacle", bound(around)},
        {"on both sides", bound(both)},
        {"DeWolf's product", Flow(psrd(1), productBounded(psrd(2), sphereSdf(1), 0.4))},
        {"on a surface",
         Flow(psrd(1), sphereSdf(1).distance, {.box = Box{{{0.3, 0.3, 0.3}}, {{1, 1, 1}}}, .wall = {}})},
        {"classical curl noise", curlFlow(std::array{psrd(1), psrd(2), psrd(3)})},
        {"curl noise in 2D", curlFlow(std::array{plane(1), plane(2), plane(3)})},
        {"vortex", vortexFlow(1, 0.3)},
        {"updraft and noise", updraftFlow(1, 1) + Flow(psrd(1), psrd(2))},
        {"deformation", enrightFlow()},
        {"reshaped", reshaped(Flow(psrd(1), psrd(2)), {.limit = 5})},
        {"warped", Flow(noiseField<SimplexNoise<3>>({.seed = 1}, {.octaves = 3, .warp = 0.1}), psrd(2))},
        {"carried", Flow(sine(1) + carried(sine(2), large), psrd(3))}};
    for (const auto& [name, flow] : flows) {
        const DivergenceDiagnostics check = diagnoseDivergence(flow, 10000);
        CAPTURE(name, check.step, check.byDifferences, check.byHalfDifferences);
        CHECK(check.trace < 1e-9);
        // The order is two, but 3/2 where third derivatives jump, with a margin of 0.2 since few samples are there. The
        // differences of the deformation cancel exactly.
        CHECK(check.order().value_or(2) > 1.2);
        CHECK(check.order().value_or(2) < 2.1);
        CHECK(check.byDifferences < 2e-3);
        CHECK(check.vanishes());
    }
    const DivergenceDiagnostics in4D =
        diagnoseDivergence(FlowN<4>({noiseField<SimplexNoise<4>>({.seed = 1}), noiseField<SimplexNoise<4>>({.seed = 2}),
                                     noiseField<SimplexNoise<4>>({.seed = 3})}),
                           5000);
    CHECK(in4D.order().value() == Approx(2).margin(0.3));
    const DivergenceDiagnostics still = diagnoseDivergence(uniformFlow({{1, 2, 3}}), 1000);
    CHECK(still.byDifferences == 0);
    CHECK_FALSE(still.order());
    CHECK(still.vanishes());
}

TEST_CASE("diagnoseDivergence: detects kinks of a potential that the trace misses", "[track]") {
    const auto noise = [](uint64_t seed) { return noiseField<Psrd3>({.seed = seed}); };
    const auto flow = [&](double smoothing) { return Flow(smoothMin(noise(1), noise(2), smoothing), noise(3)); };
    const DivergenceDiagnostics kink = diagnoseDivergence(flow(0), 50000);
    CHECK(kink.trace < 1e-9);
    CHECK(kink.byDifferences > 0.05);
    CHECK(kink.order().value() ==
          Approx(-0.5).margin(0.2)); // half the step: half as many samples see a jump that is twice as steep
    CHECK_FALSE(kink.vanishes());
    const DivergenceDiagnostics smooth = diagnoseDivergence(flow(0.3), 20000);
    CHECK(smooth.byDifferences < 2e-3);
    CHECK(smooth.order().value() > 1); // third derivatives jump at the border of the smoothing
    // Derivatives that jump: a potential that is carried by a flow that is not C³.
    const Flow carrying(noise(4), noise(5));
    const DivergenceDiagnostics rough = diagnoseDivergence(Flow(carried(noise(1), carrying), noise(2)), 20000);
    CHECK(rough.order().value() > 0.4);
    CHECK(rough.vanishes());
    // A flow that is not divergence-free.
    CHECK_FALSE(diagnoseDivergence(Flow(noise(1), noise(2)).normalized(1), 5000).vanishes());
}

TEST_CASE("diagnoseDivergence: does not depend on the scale of the flow", "[track]") {
    const auto check = [](double frequency) {
        const auto noise = [&](uint64_t seed) { return noiseField<Psrd3>({.seed = seed}, {.frequency = frequency}); };
        return diagnoseDivergence(Flow(noise(1), noise(2), {.box = Box{}.padded(1 / frequency), .wall = {}}), 5000);
    };
    // The same samples of the same flow, except for rounding.
    CHECK(check(32).byDifferences == Approx(check(1).byDifferences).epsilon(1e-6));
    CHECK(check(32).step * 32 == Approx(check(1).step));
}

TEST_CASE("diagnoseField: differences converge to the gradient with second order", "[track]") {
    const Box box = Box{}.padded(1);
    const FieldDiagnostics good = diagnoseField(noiseField<Psrd3>({.seed = 1}, {.frequency = 2}), box, 5000);
    CHECK(good.byDifferences < 1e-3);
    CHECK(good.byDifferences / good.byHalfDifferences == Approx(4).epsilon(0.1));
    // They do not converge to a vector field that is not a gradient.
    const FieldDiagnostics bad =
        diagnoseField(ScalarField(BlendedGradients{sphereSdf(1).distance, noiseField<Psrd3>()}), box, 5000);
    CHECK(bad.byDifferences / bad.byHalfDifferences < 1.5);
    CHECK(diagnoseField(constantField(2.0), box, 100).byDifferences == 0);
}

TEST_CASE("diagnoseParticles: tells particles on their tracks from displaced ones", "[track]") {
    const Flow flow = contained();
    Points particles = scatter(flow.domain(), 2000, 1);
    advect(flow, particles, {.time = 1, .steps = 10});
    const ParticleDiagnostics good = diagnoseParticles(flow, particles);
    CHECK(good.points == 2000);
    CHECK(good.outside == 0);
    CHECK(good.penetration < 0);
    CHECK(good.driftF < 1e-7);
    CHECK(good.driftG < 1e-7);

    particles.x[0] = 1.5;
    particles.y[0] = particles.z[0] = 0;
    const ParticleDiagnostics bad = diagnoseParticles(flow, particles);
    CHECK(bad.outside == 1);
    CHECK(bad.penetration == Approx(0.5));
    CHECK(bad.driftF + bad.driftG > 1e-4);
}
