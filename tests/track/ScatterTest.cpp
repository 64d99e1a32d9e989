// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Formula.h"
#include "curlew/track/Scatter.h"
#include "support/MovingPoints.h"
#include "support/Points.h"

#include <limits>
#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

Domain domainOf(const Sdf& sdf, Side side) { return Domain::of({.sdf = sdf, .side = side, .width = 0.1}); }

/// Requires that `seen` of `count` agrees with a probability within 5 sigma.
void requireShare(double seen, double count, double probability) {
    CAPTURE(seen, count, probability);
    CHECK(std::abs(seen - count * probability) < 5 * std::sqrt(count * probability * (1 - probability)));
}

} // namespace

TEST_CASE("scatter: points lie in the domain and are numbered", "[track]") {
    const Sdf shape = placed(torusSdf(0.7, 0.25), {.offset = {{3, 0, -1}}, .rotate = {{30, 40, 50}}});
    const Side side = GENERATE(Side::inside, Side::outside, Side::both);
    const Domain domain = domainOf(shape, side);
    const Points particles = scatter(domain, 20000, 1);
    REQUIRE(particles.size() == 20000);
    CHECK_FALSE(particles.hasTrack());
    CHECK_FALSE(particles.hasVelocity());
    for (size_t k = 0; k < particles.size(); ++k) {
        const Vec3d p = position(particles, k);
        const double d = shape.distance.at<0>(p).value;
        CAPTURE(k, p, d);
        if (particles.id[k] != static_cast<int64_t>(k)) FAIL("id");
        if (!domain.box.contains(p)) FAIL("not in the box");
        if (!(beyondWall(side, d) < 0)) FAIL("not on the flow's side");
    }
}

TEST_CASE("scatter: points are uniform in volume", "[track]") {
    constexpr size_t kCount = 80000;
    SECTION("in a sphere by octants and radii") {
        const Points particles = scatter(domainOf(sphereSdf(1), Side::inside), kCount, 2);
        std::array<double, 8> octants{};
        double within = 0;
        for (size_t k = 0; k < kCount; ++k) {
            const Vec3d p = position(particles, k);
            ++octants[static_cast<size_t>((p[0] > 0) + 2 * (p[1] > 0) + 4 * (p[2] > 0))];
            within += length(p) < 0.5;
        }
        for (const double n : octants) requireShare(n, kCount, 0.125);
        requireShare(within, kCount, 0.125);
    }
    SECTION("in a box without a wall") {
        const Points particles = scatter({.box = {{{-1, 0, 2}}, {{1, 5, 2.5}}}, .wall = {}}, kCount, 3);
        double low = 0, corner = 0;
        for (size_t k = 0; k < kCount; ++k) {
            const Vec3d p = position(particles, k);
            low += p[1] < 1;
            corner += p[0] > 0.9 && p[1] > 4.9 && p[2] > 2.45;
        }
        requireShare(low, kCount, 0.2);
        requireShare(corner, kCount, 0.05 * 0.02 * 0.1);
    }
    SECTION("on both sides of a sphere") {
        const Domain domain = domainOf(sphereSdf(1), Side::both); // the box is [-2, 2]³
        const Points particles = scatter(domain, kCount, 4);
        double inside = 0;
        for (size_t k = 0; k < kCount; ++k) inside += length(position(particles, k)) < 1;
        requireShare(inside, kCount, 4 * std::numbers::pi / 3 / 64);
    }
}

TEST_CASE("scatter: point k depends on the seed and k only", "[track]") {
    const Domain domain = domainOf(sphereSdf(1), Side::inside);
    const Points many = scatter(domain, 1000, 7), few = scatter(domain, 100, 7), other = scatter(domain, 100, 8);
    const ThreadLimit limit(1);
    const Points alone = scatter(domain, 1000, 7);
    CHECK((alone.x == many.x && alone.y == many.y && alone.z == many.z));
    int same = 0;
    for (size_t k = 0; k < 100; ++k) {
        CHECK(position(many, k) == position(few, k));
        same += position(other, k) == position(few, k);
    }
    CHECK(same == 0);
    CHECK(scatter(domain, 0, 7).size() == 0);
    const Points later = scatterFrom(domain, 900, 100, 7);
    for (size_t k = 0; k < 100; ++k) {
        CHECK(later.id[k] == static_cast<int64_t>(900 + k));
        CHECK(position(later, k) == position(many, 900 + k));
    }
    CHECK_THROWS_AS(scatterFrom(domain, -1, 10, 7), ValueError);
}

TEST_CASE("scatter: a domain without volume is an error", "[track]") {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const Wall far{.sdf = placed(sphereSdf(1), {.offset = {{9, 0, 0}}}), .side = Side::inside, .width = 0.1};
    CHECK_THROWS_AS(scatter({.box = cube(1), .wall = far}, 10, 1), ValueError);
    CHECK_THROWS_AS(scatter({.box = cube(kInfinity), .wall = {}}, 10, 1), ValueError);
    CHECK_THROWS_AS(scatter({.box = cube(std::nan("")), .wall = {}}, 10, 1), ValueError);
    CHECK_THROWS_AS(scatter({.box = cube(0), .wall = {}}, 10, 1), ValueError);
    CHECK_THROWS_AS(scatter({.box = cube(-1), .wall = {}}, 10, 1), ValueError);
    // The ranges of some cells would allow points, but no point exists: the whole box is inside the obstacle.
    const Wall around{.sdf = sphereSdf(1.75), .side = Side::outside, .width = 0.1};
    CHECK_THROWS_AS(scatter({.box = cube(1), .wall = around}, 10, 1), ValueError);
    const Monitor cancelled{.report = {}, .cancelled = [] { return true; }};
    CHECK_THROWS_AS(scatter({.box = cube(1), .wall = {}}, 10, 1, cancelled), Interrupted);
}

namespace {

ScatterOptions onSurface(uint64_t seed, double level = 0) {
    return {.seed = seed, .on = ScatterOn::surface, .level = level};
}

} // namespace

TEST_CASE("scatter on a surface: points lie on the level and depend on seed and number only", "[track]") {
    const Sdf shape = placed(torusSdf(0.7, 0.25), {.offset = {{3, 0, -1}}, .rotate = {{30, 40, 50}}});
    const double level = GENERATE(0.0, 0.03, -0.05);
    const Domain domain = domainOf(shape, Side::inside);
    const Points all = scatterFrom(domain, 0, 5000, onSurface(4, level));
    for (size_t k = 0; k < all.size(); ++k) {
        REQUIRE(shape.distance.at<0>(position(all, k)).value == Approx(level).margin(2e-9));
        REQUIRE(all.id[k] == static_cast<int64_t>(k));
    }
    const Points later = scatterFrom(domain, 1000, 500, onSurface(4, level));
    for (size_t k = 0; k < 500; ++k) REQUIRE(position(later, k) == position(all, 1000 + k));
    const ThreadLimit one(1);
    CHECK(scatterFrom(domain, 0, 5000, onSurface(4, level)).x == all.x);
}

TEST_CASE("scatter on a surface: no point lies outside a box that is given", "[track]") {
    Domain domain = domainOf(sphereSdf(1), Side::outside);
    domain.box = {{{0, 0, 0}}, {{0.8, 0.8, 0.8}}};
    ScatterOptions options = onSurface(5, 0.05);
    const auto outside = [&] {
        const Points p = scatterFrom(domain, 0, 5000, options);
        size_t count = 0;
        for (size_t k = 0; k < p.size(); ++k) count += !domain.box.contains(p.position(k));
        return count;
    };
    CHECK(outside() > 100); // cells of the surface overlap the box's faces
    options.within = domain.box;
    CHECK(outside() == 0);
    options.within = Box{{{2, 2, 2}}, {{3, 3, 3}}};
    CHECK_THROWS_WITH(outside(), Catch::Matchers::Contains("the box"));
}

TEST_CASE("scatter on a surface: points are uniform by area", "[track]") {
    constexpr size_t kCount = 40000;
    SECTION("on a sphere by bands of equal height") {
        const Points p = scatterFrom(domainOf(sphereSdf(1), Side::outside), 0, kCount, onSurface(1));
        std::array<double, 10> bands{};
        for (size_t k = 0; k < kCount; ++k) ++bands[static_cast<size_t>(std::clamp(5 + 5 * p.y[k], 0.0, 9.0))];
        for (const double n : bands) requireShare(n, kCount, 0.1);
    }
    SECTION("on a torus by its outer half") {
        const Points p = scatterFrom(domainOf(torusSdf(0.7, 0.25), Side::inside), 0, kCount, onSurface(2));
        double outer = 0;
        for (size_t k = 0; k < kCount; ++k) outer += std::hypot(p.x[k], p.z[k]) > 0.7;
        requireShare(outer, kCount, 0.5 + 0.25 / (0.7 * std::numbers::pi)); // Pappus
    }
    SECTION("on a box by the areas of its faces") {
        const Points p = scatterFrom(domainOf(boxSdf({{1, 2, 3}}, 1e-3), Side::inside), 0, kCount, onSurface(3));
        double across = 0;
        for (size_t k = 0; k < kCount; ++k) across += std::abs(std::abs(p.x[k]) - 0.5) < 1e-4;
        requireShare(across, kCount, 6.0 / 11);
    }
}

TEST_CASE("scatter: density thins points out and a wall excludes them", "[track]") {
    constexpr size_t kCount = 20000;
    const Domain sphere = domainOf(sphereSdf(1), Side::inside);
    ScatterOptions options = onSurface(5);
    options.density = formulaField([](const auto& x) { return x[1] * 0.5 + 0.5; }); // 0 at the south pole
    const Points p = scatterFrom(sphere, 0, kCount, options);
    double north = 0;
    for (size_t k = 0; k < kCount; ++k) north += p.y[k] > 0;
    requireShare(north, kCount, 0.75);
    const Domain ball = domainOf(placed(sphereSdf(0.5), {.offset = {{0, 1, 0}}}), Side::outside);
    for (const ScatterOn on : {ScatterOn::surface, ScatterOn::volume}) {
        const Points clear = scatterFrom(sphere, 0, 2000, {.seed = 1, .on = on, .clear = ball});
        for (size_t k = 0; k < 2000; ++k) REQUIRE(ball.wall->sdf.distance.at<0>(position(clear, k)).value > 0);
    }
    options.density = formulaField([](const auto& x) { return x[0] * 0.0; });
    CHECK_THROWS_AS(scatterFrom(sphere, 0, 10, options), ValueError);
    CHECK_THROWS_AS(scatterFrom({.box = cube(1), .wall = {}}, 0, 10, onSurface(1)), ValueError);
}
