#include "curlew/base/Error.h"
#include "curlew/track/VolumeChange.h"
#include "support/Points.h"
#include "support/Polynomial.h"

using namespace curlew;
using namespace curlew::test;

TEST_CASE("a divergence-free flow keeps volumes, and one that is not does not", "[track]") {
    const Flow flow(sinesF(), sinesG(), {.box = cube(3), .wall = {}});
    const auto points = randomPoints(cube(1), 200, 3);
    const AdvectOptions options{.time = 0.3, .steps = 30};
    const VolumeChange kept = volumeChange(flow, points, 0, options);
    CHECK(kept.samples == 200);
    CHECK(kept.median == Approx(1).margin(1e-6));
    CHECK(kept.lower == Approx(1).margin(2e-3));
    CHECK(kept.upper == Approx(1).margin(2e-3));
    const VolumeChange changed = volumeChange(flow.normalized(1), points, 0, options);
    CHECK(changed.lower < 0.9);
    CHECK(changed.upper > 1.1);
}

TEST_CASE("volumes of nothing, and differences without a step", "[track]") {
    const Flow flow(sinesF(), sinesG(), {.box = cube(3), .wall = {}});
    CHECK(volumeChange(flow, {}, 0, {}).samples == 0);
    CHECK_THROWS_AS(volumeChange(flow, {Vec3d{}}, 0, {}, std::nan("")), ValueError);
    CHECK_THROWS_AS(volumeChange(flow, {Vec3d{}}, 0, {}, -1), ValueError);
}
