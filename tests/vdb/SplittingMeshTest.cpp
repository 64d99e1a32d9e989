// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flows.h"
#include "curlew/flow/Wind.h"
#include "curlew/track/Advect.h"
#include "curlew/track/FlowAtWall.h"
#include "curlew/track/Scatter.h"
#include "curlew/vdb/LevelSet.h"
#include "support/Catch.h"
#include "support/Places.h"

using namespace curlew;

namespace {

ScalarField noise(uint64_t seed) { return noiseField<Psrd3>({.seed = seed}, {.frequency = 2}); }

/// Spot, with a band as wide as the wall layers below.
Sdf spot() {
    auto mesh = std::make_shared<Mesh>(readMesh(test::sourceDir() + "/scenes/spot.obj"));
    return sdfOf(meshToLevelSet(std::move(mesh), {.dim = 64, .halfWidth = 12}));
}

} // namespace

TEST_CASE("splitting: no particle of a sum leaves or enters a mesh for any step size", "[vdb]") {
    const Sdf sdf = spot();
    const Side side = GENERATE(Side::inside, Side::outside);
    const Wall wall{.sdf = sdf, .side = side, .width = 0.1};
    const Domain domain = Domain::of(wall);
    const ScalarField ramp = (2 / wall.width) * clipped(sdf.distance, wall.width);
    const Flow bound = withSpeed(Flow(noise(1), bounded(noise(2), wall), domain), 1);
    const Flow curl = withSpeed(curlFlow(std::array{ramp * noise(3), ramp * noise(4), ramp * noise(5)}, domain), 1);
    const Flow wind = windFlow({.sdf = sdf, .side = side, .width = 0.25}, noise(6), {.gusts = 0.3}).within(domain);
    const Flow sum = bound + curl + wind;
    for (const AtWall& term : sumAtWall(sum, 500).terms) CHECK(term.tangent());
    const Points start = scatter(domain, 1000, 1);
    const auto outside = [&](const Points& p) {
        size_t count = 0;
        for (size_t k = 0; k < p.size(); ++k) count += !(beyondWall(side, sdf.distance.at<0>(p.position(k)).value) < 0);
        return count;
    };
    // Steps of half a body's length, of a leg's width, and shorter than the layer.
    for (const auto& [steps, scheme, splitting] : {std::tuple(2, Scheme::euler, Splitting::strang),
                                                   {10, Scheme::rk4, Splitting::strang},
                                                   {40, Scheme::rk4, Splitting::strang},
                                                   {2, Scheme::euler, Splitting::none},
                                                   {10, Scheme::rk4, Splitting::none}}) {
        Points particles = start;
        const AdvectResult result =
            advect(sum, particles, {.time = 1, .steps = steps, .scheme = scheme, .splitting = splitting});
        CAPTURE(static_cast<int>(side), steps, result.notConverged, result.retries, result.stalled);
        CHECK(result.splitting == splitting);
        CHECK(result.outside == 0);
        CHECK(outside(particles) == 0);
        CHECK(result.drift[0] <= 1e-8 * (1 + 1e-12));
        // If a step is as long as the body, reprojection fails for most points, and they wait.
        if (steps > 2) CHECK(result.notConverged < start.size() / 10);
    }
    Points free = start;
    advect(sum, free, {.time = 1, .steps = 2, .scheme = Scheme::euler, .reprojection = {.method = Reprojection::none}});
    CHECK(outside(free) > 0);
}
