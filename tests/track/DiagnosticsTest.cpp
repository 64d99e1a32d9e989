#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/track/Advect.h"
#include "curlew/track/Diagnostics.h"
#include "curlew/track/Scatter.h"

#include <catch2/catch.hpp>

using namespace curlew;

namespace {

Wall ball() { return {.sdf = sphereSdf(1), .side = Side::inside, .width = 0.25}; }

Flow contained() {
    return withSpeed(Flow(noiseField<Psrd3>({.seed = 1}, {.frequency = 2}),
                          bounded(noiseField<Psrd3>({.seed = 2}, {.frequency = 2}), ball()), Domain::of(ball())),
                     1);
}

/// Eq. 13 as it is often written by mistake: the gradients are blended, not the functions. No function has this
/// gradient.
struct BlendedGradients {
    ScalarField distance, noise;
    template <int Order, class T>
    Jet<T, 3, Order> at(const Vec3d& p) const {
        const auto d = distance.at<Order, T>(p), n = noise.at<Order, T>(p);
        const T alpha = std::clamp(-d.value / T(0.25), T(0), T(1));
        return d * (T(1) - alpha) + n * alpha;
    }
};

} // namespace

TEST_CASE("a contained flow keeps its promises", "[Diagnostics]") {
    const FlowDiagnostics check = diagnoseFlow(contained(), 20000);
    CHECK(check.divergence.trace < 1e-9);
    CHECK(check.divergence.traceBeyond <= check.divergence.trace);
    CHECK(check.wallFlux < 1e-6);
    CHECK(check.wallSamples > 1000);
    CHECK(check.magnitudes.speed == Approx(1));
}

TEST_CASE("the check finds a flow that crosses its wall", "[Diagnostics]") {
    const Flow leaking(noiseField<Psrd3>({.seed = 1}, {.frequency = 2}),
                       noiseField<Psrd3>({.seed = 2}, {.frequency = 2}), Domain::of(ball()));
    CHECK(diagnoseFlow(leaking, 5000).wallFlux > 0.1);
}

TEST_CASE("the check finds a potential whose gradient is not one", "[Diagnostics]") {
    const ScalarField noise = noiseField<Psrd3>({.seed = 2}, {.frequency = 2});
    const Flow wrong(noiseField<Psrd3>({.seed = 1}, {.frequency = 2}),
                     ScalarField(BlendedGradients{ball().sdf.distance, noise}), Domain::of(ball()));
    CHECK(diagnoseFlow(wrong, 5000).divergence.byDifferences > 1e-2);
    // A right one: what is left are the differences' own errors, h² of the third derivatives.
    CHECK(diagnoseFlow(contained(), 5000).divergence.byDifferences < 1e-5);
}

TEST_CASE("differences come to the gradient of a field with the square of their step", "[Diagnostics]") {
    const Box box = Box{}.padded(1);
    const FieldDiagnostics good = diagnoseField(noiseField<Psrd3>({.seed = 1}, {.frequency = 2}), box, 5000);
    CHECK(good.byDifferences < 1e-3);
    CHECK(good.byDifferences / good.byHalfDifferences == Approx(4).epsilon(0.1));
    // Not to what is no gradient.
    const FieldDiagnostics bad =
        diagnoseField(ScalarField(BlendedGradients{sphereSdf(1).distance, noiseField<Psrd3>()}), box, 5000);
    CHECK(bad.byDifferences / bad.byHalfDifferences < 1.5);
    CHECK(diagnoseField(constantField(2.0), box, 100).byDifferences == 0);
}

TEST_CASE("particles on their tracks, and those that left", "[Diagnostics]") {
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
