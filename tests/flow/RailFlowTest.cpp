// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/flow/RailFlow.h"
#include "support/FlowChecks.h"

#include <numbers>

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;

namespace {

RailPointer knot(double turns = 0) {
    std::vector<Vec3d> points;
    for (int k = 0; k < 60; ++k) {
        const double t = 2 * std::numbers::pi * k / 60;
        points.push_back({{(1 + 0.4 * std::cos(3 * t)) * std::cos(2 * t), (1 + 0.4 * std::cos(3 * t)) * std::sin(2 * t),
                           0.4 * std::sin(3 * t)}});
    }
    return std::make_shared<Rail>(points, true, turns);
}

RailPointer line(const Vec3d& from, const Vec3d& to) { return std::make_shared<Rail>(std::vector<Vec3d>{from, to}); }

/// Points in the tube of the first rail.
std::vector<Vec3d> inTube(const Rail& rail, double radius, size_t count) {
    std::vector<Vec3d> points;
    for (uint64_t k = 0; points.size() < count; ++k) {
        const Vec3d p = rail.at(rail.length() * randomUniform(1, k, 0)) + randomPoint(cube(radius), 2, k);
        if (rail.nearest(p).distance < radius) points.push_back(p);
    }
    return points;
}

} // namespace

TEST_CASE("railFlow: has the given speed along the rail, and no divergence", "[flow]") {
    const RailPointer rail = std::make_shared<Rail>(
        std::vector<Vec3d>{{{-1, 0, 0}}, {{-0.3, 0.3, 0.1}}, {{0.4, 0.1, 0.4}}, {{1, 0.4, 0.1}}});
    for (const auto profile : {RailProfile::plug, RailProfile::smooth}) {
        const Flow flow = railFlow({rail}, {.radius = 0.15, .speed = 2, .profile = profile});
        CHECK(flow.hasTracks());
        for (const double along : {0.1, 0.7, 1.6}) {
            const Vec3d ahead = (rail->at(along + 1e-6) - rail->at(along - 1e-6)) * 5e5;
            CHECK(length(flow.at(rail->at(along)).velocity - ahead * 2.0) < 1e-5);
        }
        for (const Vec3d& p : inTube(*rail, 0.15, 300)) {
            const auto sample = flow.at(p);
            const double rho = rail->nearest(p).distance / 0.15, share = 1 - rho * rho;
            CAPTURE(p, rho);
            CHECK(std::abs(trace(sample.derivative)) <= 1e-12 * (1 + frobenius(sample.derivative)));
            CHECK(length(sample.velocity) ==
                  Approx(profile == RailProfile::plug ? 2 : 2 * share * share * share).margin(1e-12));
        }
        if (profile == RailProfile::smooth) CHECK(flow.at({{0, 2, 0}}).velocity == Vec3d{});
    }
}

TEST_CASE("railFlow: on a twisted closed rail, it turns about the rail", "[flow]") {
    const RailPointer rail = knot(0.5);
    const Flow flow = railFlow({rail}, {.radius = 0.1});
    for (const Vec3d& p : inTube(*rail, 0.1, 300)) {
        const auto sample = flow.at(p);
        CHECK(std::abs(trace(sample.derivative)) <= 1e-11 * (1 + frobenius(sample.derivative)));
        const auto distance = flow.domain().wall->sdf.distance.at<1>(p);
        CHECK(std::abs(dot(sample.velocity, distance.gradient)) < 1e-11); // it keeps its distance
    }
}

TEST_CASE("railFlow: tubes of several rails add if they are smooth, and must not touch otherwise", "[flow]") {
    const std::vector<RailPointer> crossing{line({{-1, 0, 0}}, {{1, 0, 0}}), line({{0, -1, 0}}, {{0, 1, 0}})};
    const Flow sum = railFlow(crossing, {.radius = 0.2, .profile = RailProfile::smooth});
    CHECK(sum.terms().size() == 2);
    CHECK(length(sum.at({{0, 0, 0}}).velocity - Vec3d{{1, 1, 0}}) < 1e-12);
    CHECK(length(sum.at({{0.5, 0, 0}}).velocity - Vec3d{{1, 0, 0}}) < 1e-12);
    CHECK_THROWS_WITH(railFlow(crossing, {.radius = 0.2}), ContainsSubstring("touch"));
    const Flow apart = railFlow({line({{-1, 0, 0}}, {{1, 0, 0}}), line({{0, -1, 1}}, {{0, 1, 1}})}, {.radius = 0.2});
    CHECK(apart.terms().size() == 1);
    CHECK(length(apart.at({{0, 0, 0.9}}).velocity - Vec3d{{0, 1, 0}}) < 1e-12);
    CHECK_THROWS_WITH(railFlow({knot()}, {.radius = 5}), ContainsSubstring("bend"));
    CHECK_THROWS_WITH(railFlow({knot()}, {.speed = 0}), ContainsSubstring("speed"));
}
