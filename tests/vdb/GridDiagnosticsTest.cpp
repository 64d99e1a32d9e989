#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/track/Advect.h"
#include "curlew/track/Scatter.h"
#include "curlew/vdb/Check.h"
#include "curlew/vdb/VelocityGrid.h"

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

TEST_CASE("a contained flow keeps its promises", "[Check]") {
    const FlowCheck check = checkFlow(contained(), 20000);
    CHECK(check.divergence.trace < 1e-9);
    CHECK(check.divergence.traceBeyond <= check.divergence.trace);
    CHECK(check.wallFlux < 1e-6);
    CHECK(check.wallSamples > 1000);
    CHECK(check.magnitudes.speed == Approx(1));
}

TEST_CASE("the check finds a flow that crosses its wall", "[Check]") {
    const Flow leaking(noiseField<Psrd3>({.seed = 1}, {.frequency = 2}),
                       noiseField<Psrd3>({.seed = 2}, {.frequency = 2}), Domain::of(ball()));
    CHECK(checkFlow(leaking, 5000).wallFlux > 0.1);
}

TEST_CASE("the check finds a potential whose gradient is not one", "[Check]") {
    const ScalarField noise = noiseField<Psrd3>({.seed = 2}, {.frequency = 2});
    const Flow wrong(noiseField<Psrd3>({.seed = 1}, {.frequency = 2}),
                     ScalarField(BlendedGradients{ball().sdf.distance, noise}), Domain::of(ball()));
    CHECK(checkFlow(wrong, 5000).divergence.byDifferences > 1e-2);
    // A right one: what is left are the differences' own errors, h² of the third derivatives.
    CHECK(checkFlow(contained(), 5000).divergence.byDifferences < 1e-5);
}

TEST_CASE("differences come to the gradient of a field with the square of their step", "[Check]") {
    const Box box = Box{}.padded(1);
    const FieldCheck good = checkField(noiseField<Psrd3>({.seed = 1}, {.frequency = 2}), box, 5000);
    CHECK(good.byDifferences < 1e-3);
    CHECK(good.byDifferences / good.byHalfDifferences == Approx(4).epsilon(0.1));
    // Not to what is no gradient.
    const FieldCheck bad =
        checkField(ScalarField(BlendedGradients{sphereSdf(1).distance, noiseField<Psrd3>()}), box, 5000);
    CHECK(bad.byDifferences / bad.byHalfDifferences < 1.5);
    CHECK(checkField(constantField(2.0), box, 100).byDifferences == 0);
}

TEST_CASE("particles on their tracks, and those that left", "[Check]") {
    const Flow flow = contained();
    Particles particles = scatter(flow.domain(), 2000, 1);
    advect(flow, particles, {.time = 1, .steps = 10});
    const ParticleCheck good = checkParticles(flow, particles);
    CHECK(good.points == 2000);
    CHECK(good.outside == 0);
    CHECK(good.penetration < 0);
    CHECK(good.driftF < 1e-7);
    CHECK(good.driftG < 1e-7);

    particles.x[0] = 1.5;
    particles.y[0] = particles.z[0] = 0;
    const ParticleCheck bad = checkParticles(flow, particles);
    CHECK(bad.outside == 1);
    CHECK(bad.penetration == Approx(0.5));
    CHECK(bad.driftF + bad.driftG > 1e-4);
}

TEST_CASE("tracks are kept by the flow, and lost on its grid", "[Check]") {
    const Flow flow = contained();
    const auto layout = GENERATE(Layout::collocated, Layout::staggered);
    const auto grid = velocityGrid(flow, {.dim = 64, .layout = layout});
    const TrackCheck check = checkTracks(flow, *grid, 400, 200);
    CHECK(check.time == Approx(400 * 0.25 * grid->voxelSize()[0]));
    CHECK(check.field.outside == 0);
    CHECK(check.field.driftF < 1e-7);
    CHECK(check.field.driftG < 1e-7);
    CHECK(check.onGrid.driftF > 1e-2);
    CHECK(check.onGrid.driftG > 1e-2);
    // A finer grid loses them later.
    const auto fine = velocityGrid(flow, {.dim = 128, .layout = layout});
    const TrackCheck finer = checkTracks(flow, *fine, 800, 200);
    CHECK(finer.onGrid.driftF < 0.6 * check.onGrid.driftF);
}

TEST_CASE("a grid's divergence is OpenVDB's", "[Check]") {
    // c = (x, 0, 0) on a block: divergence 1, and the differences are exact.
    auto grid = openvdb::Vec3SGrid::create(openvdb::Vec3s(0));
    const double voxel = 0.5;
    grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
    double squares = 0;
    for (int i = 0; i < 8; ++i)
        for (int j = 0; j < 8; ++j)
            for (int k = 0; k < 8; ++k) {
                grid->tree().setValue({i, j, k}, {static_cast<float>(i * voxel), 0, 0});
                squares += i * voxel * i * voxel;
            }
    const GridCheck check = checkVelocity(*grid);
    CHECK(check.voxels == 512);
    CHECK(check.interior == 216);
    CHECK(check.rmsSpeed == Approx(std::sqrt(squares / 512)));
    CHECK(check.divergence == Approx(voxel / check.rmsSpeed));
    CHECK(check.divergenceOverall > check.divergence); // the jump to the background counts there
    CHECK(checkVelocity(*openvdb::Vec3SGrid::create()).voxels == 0);
}
