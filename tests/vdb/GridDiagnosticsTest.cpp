// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/vdb/GridDiagnostics.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/VelocityGrid.h"
#include "support/Catch.h"

using namespace curlew;

namespace {

Wall ball() { return {.sdf = sphereSdf(1), .side = Side::inside, .width = 0.25}; }

Flow contained() {
    return withSpeed(Flow(noiseField<Psrd3>({.seed = 1}, {.frequency = 2}),
                          bounded(noiseField<Psrd3>({.seed = 2}, {.frequency = 2}), ball()), Domain::of(ball())),
                     1);
}

} // namespace

TEST_CASE("diagnoseTracks: the flow keeps tracks and its grid loses them", "[vdb]") {
    const Flow flow = contained();
    const auto layout = GENERATE(Layout::collocated, Layout::staggered);
    const auto grid = velocityGrid(flow, {.dim = 64, .layout = layout});
    const TrackDiagnostics check = diagnoseTracks(flow, *grid, 400, 200);
    CHECK(check.time == Approx(400 * 0.25 * grid->voxelSize()[0]));
    CHECK(check.field.outside == 0);
    CHECK(check.field.driftF < 1e-7);
    CHECK(check.field.driftG < 1e-7);
    CHECK(check.onGrid.driftF > 1e-2);
    CHECK(check.onGrid.driftG > 1e-2);
    // On a finer grid, particles leave their tracks later.
    const auto fine = velocityGrid(flow, {.dim = 128, .layout = layout});
    const TrackDiagnostics finer = diagnoseTracks(flow, *fine, 800, 200);
    CHECK(finer.onGrid.driftF < 0.6 * check.onGrid.driftF);
}

TEST_CASE("diagnoseGrid: divergence agrees with OpenVDB", "[vdb]") {
    // c = (x, 0, 0) on a block: the divergence is 1, and the differences are exact.
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
    const GridDiagnostics check = diagnoseGrid(*grid);
    CHECK(check.voxels == 512);
    CHECK(check.interior == 216);
    CHECK(check.rmsSpeed == Approx(std::sqrt(squares / 512)));
    CHECK(check.divergence == Approx(voxel / check.rmsSpeed));
    CHECK(check.divergenceOverall > check.divergence); // it includes the jump to the background
    CHECK(diagnoseGrid(*openvdb::Vec3SGrid::create()).voxels == 0);
}
