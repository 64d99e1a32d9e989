// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/Advect.h"
#include "curlew/track/Emission.h"
#include "curlew/track/Scatter.h"
#include "support/Flows.h"
#include "support/MovingPoints.h"
#include "support/Points.h"

using namespace curlew;
using namespace curlew::test;

TEST_CASE("emitted: births over many frames equal those of one long frame", "[track]") {
    const Domain domain{.box = cube(1), .wall = {}};
    const double rate = GENERATE(0.0, 7.3, 100.0, 1234.5);
    const EmissionOptions options{.rate = rate, .seed = 5};
    EmissionState frames, whole;
    size_t count = 0;
    for (int k = 0; k < 24; ++k) {
        const int64_t first = frames.nextId;
        const Points born = emitted(domain, options, 1.0 / 24, frames);
        count += born.size();
        for (size_t n = 0; n < born.size(); ++n) {
            CHECK(born.id[n] == first + static_cast<int64_t>(n));
            CHECK(born.age[n] >= 0);
            CHECK(born.age[n] <= 1 / 24.0F);
            if (n > 0) CHECK(born.age[n - 1] - born.age[n] == Approx(1 / rate).margin(1e-6));
        }
        CHECK(!born.hasLife());
    }
    const Points all = emitted(domain, options, 1, whole);
    CHECK(count == all.size());
    CHECK(count == static_cast<size_t>(rate));
    const Points scattered = scatter(domain, all.size(), 5);
    CHECK(all.x == scattered.x); // the position depends only on seed and id
}

TEST_CASE("emitted: lifetimes are spread around their mean and none has ended", "[track]") {
    EmissionState state;
    const Points born = emitted({.box = cube(1), .wall = {}}, {.rate = 4000, .life = 0.6, .spread = 0.5}, 1, state);
    CHECK(state.nextId == 4000);
    CHECK(born.size() < 4000); // the first particles born in the frame have died in it
    for (size_t k = 0; k < born.size(); ++k) {
        REQUIRE(born.life[k] >= 0.3F);
        REQUIRE(born.life[k] <= 0.9F);
        REQUIRE(born.age[k] <= born.life[k]);
    }
    CHECK(emitted({.box = cube(1), .wall = {}}, {}, 0, state).size() == 0);
    CHECK_THROWS_AS(emitted({.box = cube(1), .wall = {}}, {.rate = 1e15}, 1, state), ResourceError);
}

TEST_CASE("emitted: refuses a rate or a duration that is negative or not finite", "[track]") {
    const Domain domain{.box = cube(1), .wall = {}};
    EmissionState state;
    for (const double bad : {-1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
        CHECK_THROWS_AS(emitted(domain, {.rate = bad}, 1, state), ValueError);
        CHECK_THROWS_AS(emitted(domain, {}, bad, state), ValueError);
    }
    CHECK(state.rates == 0);
}

TEST_CASE("joinFlow: newborn particles get the velocity and track that advect would give them", "[track]") {
    const Flow flow(sinesF(), sinesG());
    Points others = particlesAt({{{0, 0, 0}}}), born = particlesAt(randomPoints(cube(1), 100, 1)), plain = born;
    joinFlow(flow, others, plain);
    CHECK(!plain.hasVelocity()); // the other particles have no velocity
    Points expected = born;
    advect(flow, others, {.time = 0, .steps = 1});
    advect(flow, expected, {.time = 0, .steps = 1});
    joinFlow(flow, others, born);
    CHECK(born.vx == expected.vx);
    CHECK(born.f == expected.f);
    CHECK(born.g == expected.g);
}

TEST_CASE("flagBeyondWall: flags points by the sign of the distance", "[track]") {
    const Points points = particlesAt(randomPoints(cube(2), 500, 3));
    const auto flags = flagBeyondWall(points, {.box = {}, .wall = Wall{.sdf = sphereSdf(1), .side = Side::inside}});
    for (size_t k = 0; k < points.size(); ++k) CHECK((flags[k] != 0) == (length(points.position(k)) > 1));
}

TEST_CASE("wrap: moves positions into the box by whole periods", "[track]") {
    const Box box{{{0, -1, 2}}, {{2, 1, 2.5}}};
    const auto before = randomPoints(cube(10), 500, 4);
    Points points = particlesAt(before);
    wrap(points, box);
    for (size_t k = 0; k < points.size(); ++k)
        for (int axis = 0; axis < 3; ++axis) {
            const double x = points.position(k)[axis], period = box.size()[axis];
            CHECK(x >= box.lower[axis]);
            CHECK(x < box.upper[axis]);
            const double periods = (before[k][axis] - x) / period;
            CHECK(periods == Approx(std::round(periods)).margin(1e-12));
        }
    // A flat box has no period along its normal.
    const Box flat{{{0, -1, 2}}, {{2, 1, 2}}};
    wrap(points, flat);
    for (size_t k = 0; k < points.size(); ++k) {
        CHECK(flat.lower[1] <= points.position(k)[1]);
        CHECK(std::isfinite(points.position(k)[2]));
    }
    Box infinite = box;
    infinite.upper[0] = std::numeric_limits<double>::infinity();
    CHECK_THROWS_AS(wrap(points, infinite), ValueError);
}

TEST_CASE("emitted: particles born on a surface leave it along the normal by their age", "[track]") {
    const Domain domain = Domain::of({.sdf = sphereSdf(1), .side = Side::outside, .width = 0.1});
    EmissionState state;
    const Points born = emitted(
        domain,
        {.rate = 500, .seed = 1, .place = {.on = ScatterOn::surface, .level = 0.01, .clear = domain}, .normalSpeed = 2},
        1, state);
    REQUIRE(born.size() == 500);
    for (size_t k = 0; k < born.size(); ++k) {
        const Vec3d p = position(born, k), v{{born.vx[k], born.vy[k], born.vz[k]}};
        REQUIRE(length(p) == Approx(1.01 + 2 * static_cast<double>(born.age[k])).epsilon(1e-6));
        REQUIRE(length(v - p * (2 / length(p))) < 1e-5);
    }
}
