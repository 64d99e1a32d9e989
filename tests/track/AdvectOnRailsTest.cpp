// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/Bound.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/RailFlow.h"
#include "curlew/track/Advect.h"
#include "curlew/track/Scatter.h"
#include "support/Points.h"

#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

RailPointer ring() {
    std::vector<Vec3d> points;
    for (int k = 0; k < 24; ++k) {
        const double t = 2 * std::numbers::pi * k / 24;
        points.push_back({{std::cos(t), std::sin(t), 0.3 * std::sin(2 * t)}});
    }
    return std::make_shared<Rail>(points, true);
}

} // namespace

TEST_CASE("advect: points keep their distance from a rail, for any step", "[track]") {
    constexpr double kRadius = 0.15;
    const RailPointer rail = ring();
    for (const auto profile : {RailProfile::plug, RailProfile::smooth})
        for (const int steps : {3, 20, 60}) { // the longest steps take the points a third of the way around
            const Flow flow = railFlow({rail}, {.radius = kRadius, .profile = profile});
            Points points = scatter(flow.domain(), 200, 1);
            const Points start = points;
            advect(flow, points, {.time = 6, .steps = steps});
            Worst off;
            double moved = 0;
            for (size_t k = 0; k < points.size(); ++k) {
                const double before = rail->nearest(start.position(k)).distance,
                             after = rail->nearest(points.position(k)).distance;
                CAPTURE(steps, before, after);
                CHECK(after < kRadius);
                if (points.converged[k] && before < 0.8 * kRadius) off.see(std::abs(after - before), start.position(k));
                moved += length(points.position(k) - start.position(k)) / 200;
            }
            CAPTURE(steps, profile, off.where);
            CHECK(off.value < 1e-6 * kRadius);
            CHECK(moved > 0.1);
        }
}

TEST_CASE("advect: with noise that is bound to the tube of a rail, points stay in the tube", "[track]") {
    constexpr double kRadius = 0.15;
    const RailPointer rail = ring();
    const Flow along = railFlow({rail}, {.radius = kRadius});
    Wall wall = *along.domain().wall;
    wall.width = 0.05;
    const Flow noise(noiseField<Psrd3>({.seed = 1}, {.frequency = 4}),
                     bounded(noiseField<Psrd3>({.seed = 2}, {.frequency = 4}), wall), {along.domain().box, wall});
    const Flow sum = along + withSpeed(noise, 0.5);
    for (const auto& options : {AdvectOptions{.time = 6, .steps = 30}, AdvectOptions{.time = 6, .steps = 100},
                                AdvectOptions{.time = 6, .steps = 60, .splitting = Splitting::strang}}) {
        Points points = scatter(along.domain(), 150, 1);
        advect(sum, points, options);
        for (size_t k = 0; k < points.size(); ++k) CHECK(rail->nearest(points.position(k)).distance < kRadius);
    }
}
