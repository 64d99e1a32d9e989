// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/LayerFit.h"
#include "support/Catch.h"

#include <cmath>

using namespace curlew;

namespace {

LayerFit fitOf(const Sdf& sdf, double width) { return layerFit(Wall{.sdf = sdf, .width = width}); }

} // namespace

TEST_CASE("layerFit: a layer fits a ball up to its radius", "[field]") {
    CHECK(fitOf(sphereSdf(1), 0.3).unreached == 0);
    CHECK(fitOf(sphereSdf(1), 0.9).unreached == 0);
    CHECK(fitOf(sphereSdf(1), 0.3).fitting == 0.3);
    const LayerFit wide = fitOf(sphereSdf(1), 1.5);
    CHECK(wide.unreached == 1);
    // Accurate to one step inwards, a sixteenth of the radius, however wide the layer is.
    for (const double width : {1.5, 50.0}) CHECK(fitOf(sphereSdf(1), width).fitting == Approx(1).margin(1.0 / 16));
    CHECK(fitOf(sphereSdf(0.01), 0.02).fitting == Approx(0.01).margin(0.01 / 16));
}

TEST_CASE("layerFit: measures by volume where an object is too thin", "[field]") {
    // A ball with a rod: a capsule of radius 0.1 of which a length of 1.6 is outside the ball.
    const Sdf rod = placed(capsuleSdf(2, 0.1), Placement{.offset = {{0, 1.5, 0}}});
    const Sdf both = unite(sphereSdf(1), rod, 0);
    const double pi = 3.14159265358979, ball = 4 * pi / 3, stick = pi * 0.01 * 1.5 + 2 * pi / 3 * 0.001;
    const LayerFit fit = fitOf(both, 0.3);
    CHECK(fit.unreached == Approx(stick / (ball + stick)).margin(0.01));
    CHECK(fit.fitting == 0.3); // not enough for a warning
    const LayerFit slab = fitOf(boxSdf(Vec3d{{20, 20, 0.2}}, 0), 0.3);
    CHECK(slab.unreached == 1);
    CHECK(slab.fitting == Approx(0.1).margin(0.1 / 16));
}

TEST_CASE("layerFit: no layer fits fully near a sharp edge", "[field]") {
    // In a square bar with edge 1, the paths from a strip of width w along each edge end on the diagonal: 4 w².
    const LayerFit bar = fitOf(boxSdf(Vec3d{{1, 1, 40}}, 0), 0.3);
    CHECK(bar.unreached == Approx(4 * 0.3 * 0.3).margin(0.05)); // the width is accurate to a sixteenth
    CHECK(bar.fitting == Approx(std::sqrt(kMaxUnreached / 4)).margin(0.3 / 16));
}

TEST_CASE("layerFit: any layer fits an unbounded shape and an invalid width is an error", "[field]") {
    CHECK(fitOf(planeSdf({{0, 0, 1}}, 0), 3).unreached == 0);
    CHECK(layerFit(WallN<2>{.sdf = sphereSdf<2>(1), .width = 0.5}).unreached == 0);
    CHECK(layerFit(WallN<2>{.sdf = sphereSdf<2>(1), .width = 2}).unreached == 1);
    CHECK_THROWS_AS(fitOf(sphereSdf(1), 0), ValueError);
}
