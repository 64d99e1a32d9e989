// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/track/Pathlines.h"
#include "curlew/track/Scatter.h"
#include "support/Catch.h"
#include "support/MovingPoints.h"
#include "support/Polynomial.h"

using namespace curlew;
using namespace curlew::test;

TEST_CASE("advectWithPathlines: vertices are the particle positions after each step", "[track]") {
    const Flow flow = boundFlow(sphereSdf(1), Side::inside);
    const Points start = scatter(flow.domain(), 300, 1);
    Points along = start;
    const AdvectOptions options{.time = 0.5, .steps = 20};
    const Pathlines pathlines = advectWithPathlines(FlowInTime(flow), along, 0, options);
    const Curves& c = pathlines.curves;
    REQUIRE(c.size() == 300);
    REQUIRE(c.vertices() == size_t{300} * 21);
    REQUIRE(c.hasTrack());
    for (const int step : {0, 7, 20}) {
        Points there = start;
        advect(flow, there, {.time = 0.5 * step / 20, .steps = std::max(step, 1)});
        for (size_t k = 0; k < c.size(); ++k) {
            CAPTURE(step, k);
            const size_t v = c.start[k] + static_cast<size_t>(step);
            REQUIRE(length(c.position(v) - position(there, k)) < 1e-12); // the same steps except for rounding
            REQUIRE(c.speed(v) == Approx(length(Vec3f{{there.vx[k], there.vy[k], there.vz[k]}})).epsilon(1e-4));
            REQUIRE(c.along[v] == Approx(0.5 * step / 20));
            REQUIRE(c.f[v] == along.f[k]);
        }
    }
    for (size_t k = 0; k < c.size(); ++k) {
        REQUIRE(c.id[k] == along.id[k]);
        REQUIRE(c.position(c.start[k + 1] - 1) == position(along, k));
        double length = 0;
        for (size_t v = c.start[k] + 1; v < c.start[k + 1]; ++v)
            length += curlew::length(c.position(v) - c.position(v - 1));
        REQUIRE(c.length[k] == Approx(length));
        REQUIRE(!c.closed(k));
    }
    CHECK(pathlines.result.outside == 0);
    CHECK(pathlines.result.substeps >= size_t{300} * 20);
    CHECK_THROWS_AS(advectWithPathlines(FlowInTime(flow), along, 0, {.steps = -1}), ValueError);
    CHECK_THROWS_AS(advectWithPathlines(FlowInTime(flow), along, 0, {.steps = 1000000000}), ResourceError);
}

TEST_CASE("advectWithPathlines: newborn particles move as long as without pathlines", "[track]") {
    const Flow flow = boundFlow(sphereSdf(1), Side::inside);
    const auto inTime = GENERATE_REF(FlowInTime(flow), FlowInTime([flow](double) { return flow; }));
    Points start = scatter(flow.domain(), 100, 1);
    start.age.assign(start.size(), 0.13f);
    start.age[0] = 7;
    start.age[1] = 0;
    Points along = start, there = start;
    const AdvectOptions options{.time = 0.4, .steps = 4, .byAge = true};
    advectWithPathlines(inTime, along, 0, options);
    advect(inTime, there, 0, options);
    for (size_t k = 0; k < start.size(); ++k) CHECK(length(position(along, k) - position(there, k)) < 1e-12);
    CHECK(length(position(there, 2) - position(start, 2)) > 0.05);
    CHECK(position(along, 1) == position(start, 1));
}
