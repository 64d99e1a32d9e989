// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Wind.h"
#include "support/FlowChecks.h"
#include "support/Points.h"

using namespace curlew;
using namespace curlew::test;

namespace {

Wall wallOf(const Sdf& sdf, double width, Side side = Side::outside) {
    return {.sdf = sdf, .side = side, .width = width};
}
ScalarField gustNoise() { return noiseField<Psrd3>({.seed = 3}, {.frequency = 0.8}); }

/// Returns points of the domain's box whose distance from the wall is at least `distance`.
std::vector<Vec3d> pointsBeyond(const Flow& flow, double distance, size_t count) {
    std::vector<Vec3d> points;
    for (const Vec3d& p : randomPoints(flow.domain().box, count, 1))
        if (flow.domain().wall->sdf.distance.at<0>(p).value > distance) points.push_back(p);
    return points;
}

} // namespace

TEST_CASE("windFlow: is uniform far from the wall and tangent at the wall", "[flow]") {
    const Vec3d direction{{2, 1, -1}};
    const Sdf body = GENERATE(sphereSdf(0.5), boxSdf({{0.4, 1.2, 0.6}}, 0.1), torusSdf(0.5, 0.2));
    const double speed = 1.5;
    const Flow flow = windFlow(wallOf(body, 0.4), {}, {.direction = direction, .speed = speed});
    CHECK(flow.hasTracks());
    const Vec3d wind = direction * (speed / length(direction));
    const auto far = pointsBeyond(flow, 0.4, 500);
    REQUIRE(far.size() > 50);
    for (const Vec3d& p : far) {
        CAPTURE(p);
        REQUIRE(length(flow.at(p).velocity - wind) < 1e-12);
    }
    Worst through;
    double along = 0;
    for (Vec3d p : randomPoints(cube(1), 300, 2)) {
        for (int k = 0; k < 20; ++k) {
            const auto d = body.distance.at<1>(p);
            if (dot(d.gradient, d.gradient) > 0.1) p -= d.gradient * (d.value / dot(d.gradient, d.gradient));
        }
        const auto d = body.distance.at<1>(p);
        if (std::abs(d.value) > 1e-12) continue;
        const Vec3d c = flow.at(p).velocity;
        through.see(std::abs(dot(c, d.gradient)), p);
        along = std::max(along, length(c));
    }
    CAPTURE(through.where, along);
    CHECK(through.value < 1e-9);
    CHECK(along > 0.5); // the flow slips along the wall
}

TEST_CASE("windFlow: is divergence-free with gusts", "[flow]") {
    const Flow flow = windFlow(wallOf(sphereSdf(0.5), 0.5), gustNoise(), {.gusts = 0.5});
    CHECK(flow.hasTracks());
    // Excludes the centre of the sphere, where the distance has no gradient.
    requireDivergenceFree(flow, Box{{{0.1, -1, -1}}, {{1, 1, 1}}}, {.count = 5000});
}

TEST_CASE("windFlow: gusts have the requested rms strength", "[flow]") {
    const Vec3d direction{{0, 0, 1}};
    for (const double gusts : {0.1, 0.4}) {
        const Flow flow = windFlow(wallOf(sphereSdf(0.3), 0.3), gustNoise(),
                                   {.direction = direction, .speed = 2, .gusts = gusts, .padding = 3});
        double squares = 0;
        const auto far = pointsBeyond(flow, 0.3, 20000);
        for (const Vec3d& p : far) {
            const Vec3d extra = flow.at(p).velocity - direction * 2;
            squares += dot(extra, extra);
        }
        const double rms = std::sqrt(squares / static_cast<double>(far.size()));
        CAPTURE(gusts, rms);
        CHECK(rms == Approx(2 * gusts).epsilon(0.03)); // of samples on both sides
    }
    const Flow calm = windFlow(wallOf(sphereSdf(0.3), 0.3), gustNoise(), {.gusts = 0});
    CHECK(length(calm.at({{-0.6, 0.7, 0.5}}).velocity - Vec3d{{1, 0, 0}}) < 1e-12);
}

TEST_CASE("windFlow: the layer carries the flux that the shape displaces", "[flow]") {
    // Above the centre of a sphere of radius R, the mean over the layer is 1 + R / width.
    const double radius = 0.5, width = 0.25;
    const Flow flow = windFlow(wallOf(sphereSdf(radius), width), {}, {.across = Vec3d{{0, 1, 0}}});
    constexpr int kSamples = 4000;
    for (const double side : {1.0, -1.0}) {
        double sum = 0;
        for (int k = 0; k < kSamples; ++k)
            sum += flow.at({{0, side * (radius + width * (k + 0.5) / kSamples), 0}}).velocity[0] / kSamples;
        CHECK(sum == Approx(1 + radius / width).epsilon(1e-5));
    }
    CHECK(windWidth(sphereSdf(radius), {}) == radius);
    CHECK(flow.domain().wall->width == width / 4);
}

TEST_CASE("windAcross: deflects along the narrowest direction or the given one", "[flow]") {
    const Sdf slab = boxSdf({{1, 0.8, 0.3}}, 0.05);
    CHECK(windAcross(slab, {.direction = {{1, 0, 0}}}) == Vec3d{{0, 0, 1}});
    CHECK(windAcross(slab, {.direction = {{0, 0, 2}}}) == Vec3d{{0, 1, 0}});
    CHECK(windAcross(sphereSdf(1), {.direction = {{1, 0, 0}}}) == Vec3d{{0, 1, 0}}); // of equal axes, up
    CHECK(length(windAcross(slab, {.direction = {{0, 0, 1}}, .across = Vec3d{{3, 4, 5}}}) - Vec3d{{0.6, 0.8, 0}}) <
          1e-15);
    CHECK(windWidth(slab, {.direction = {{1, 0, 0}}}) == Approx(0.15));
    const Vec3d oblique{{1, 1, 0}};
    CHECK(std::abs(dot(windAcross(slab, {.direction = oblique}), oblique)) < 1e-15);
}

TEST_CASE("windFlow: invalid options are errors that say why", "[flow]") {
    using Catch::ContainsSubstring;
    const Sdf sphere = sphereSdf(0.5);
    const auto wind = [&](const WindOptions& options, double width = 0.5) {
        return windFlow(wallOf(sphere, width), gustNoise(), options);
    };
    CHECK_THROWS_WITH(wind({.direction = {}}), ContainsSubstring("direction"));
    CHECK_THROWS_WITH(wind({.speed = 0}), ContainsSubstring("speed"));
    CHECK_THROWS_WITH(wind({.gusts = -1}), ContainsSubstring("gusts"));
    CHECK_THROWS_WITH(wind({}, 0), ContainsSubstring("width"));
    CHECK_THROWS_WITH(wind({.direction = {{0, 1, 0}}, .across = Vec3d{{0, 2, 0}}}),
                      ContainsSubstring("parallel to the wind"));
    CHECK_THROWS_WITH(windWidth(planeSdf({{0, 1, 0}}, 0), {}), ContainsSubstring("give layer="));
    CHECK_THROWS_WITH(windFlow(wallOf(sphere, 0.5), rampField({{0, 1, 0}}), {}), ContainsSubstring("across"));
}
