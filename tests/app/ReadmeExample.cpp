// SPDX-License-Identifier: Apache-2.0
#include <curlew/field/NoiseField.h>
#include <curlew/track/Advect.h>
#include <curlew/track/Scatter.h>
#include <curlew/vdb/PointFile.h>
#include <curlew/vdb/VdbFile.h>
#include <curlew/vdb/VelocityGrid.h>
#include <openvdb/openvdb.h>

#include <cstdio>

int main() {
    using namespace curlew;
    openvdb::initialize();

    // A noise that is the distance to a sphere near it, and a second noise: a flow contained in the sphere.
    const Wall wall{.sdf = sphereSdf(1), .side = Side::inside, .width = 0.2};
    const ScalarField f = noiseField<Psrd3>({.seed = 1}, {.frequency = 2, .octaves = 2});
    const ScalarField g = bounded(noiseField<Psrd3>({.seed = 2}, {.frequency = 2, .octaves = 2}), wall);
    const Flow flow = withSpeed(Flow(f, g, Domain::of(wall)), 1);

    // As a grid whose staggered velocities are divergence-free to rounding.
    writeVdb("velocity.vdb", {velocityGrid(flow, {.voxel = 0.05, .layout = Layout::staggered})});

    // As particles, each of which stays on its own streamline: none leaves the sphere.
    Points particles = scatter(flow.domain(), 10000, /*seed=*/7);
    const AdvectResult result = advect(flow, particles, {.time = 2, .steps = 20});
    writePly("particles.ply", particles);
    std::printf("%zu particles, %zu outside\n", result.points, result.outside);
    return result.outside == 0 ? 0 : 1;
}
