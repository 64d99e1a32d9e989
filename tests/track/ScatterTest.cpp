#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/Algebra.h"
#include "curlew/track/Scatter.h"
#include "support/MovingPoints.h"
#include "support/Points.h"

#include <limits>
#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

Domain domainOf(const Sdf& sdf, Side side) { return Domain::of({.sdf = sdf, .side = side, .width = 0.1}); }

/// Requires that `seen` of `count` is what a probability says, within 5 sigma.
void requireShare(double seen, double count, double probability) {
    CAPTURE(seen, count, probability);
    CHECK(std::abs(seen - count * probability) < 5 * std::sqrt(count * probability * (1 - probability)));
}

} // namespace

TEST_CASE("scattered points lie in the domain, and have their ids", "[track]") {
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

TEST_CASE("scattered points are uniform", "[track]") {
    constexpr size_t kCount = 80000;
    SECTION("in a sphere: octants and radii") {
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
        const Domain domain = domainOf(sphereSdf(1), Side::both); // in the box from -2 to 2
        const Points particles = scatter(domain, kCount, 4);
        double inside = 0;
        for (size_t k = 0; k < kCount; ++k) inside += length(position(particles, k)) < 1;
        requireShare(inside, kCount, 4 * std::numbers::pi / 3 / 64);
    }
}

TEST_CASE("point k depends on the seed and k alone", "[track]") {
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

TEST_CASE("where nothing can be scattered is an error", "[track]") {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const Wall far{.sdf = placed(sphereSdf(1), {.offset = {{9, 0, 0}}}), .side = Side::inside, .width = 0.1};
    CHECK_THROWS_AS(scatter({.box = cube(1), .wall = far}, 10, 1), ValueError);
    CHECK_THROWS_AS(scatter({.box = cube(kInfinity), .wall = {}}, 10, 1), ValueError);
    CHECK_THROWS_AS(scatter({.box = cube(std::nan("")), .wall = {}}, 10, 1), ValueError);
    CHECK_THROWS_AS(scatter({.box = cube(0), .wall = {}}, 10, 1), ValueError);
    CHECK_THROWS_AS(scatter({.box = cube(-1), .wall = {}}, 10, 1), ValueError);
    // Cells may hold points within range, but none does: the whole box is inside of what is to be flowed around.
    const Wall around{.sdf = sphereSdf(1.75), .side = Side::outside, .width = 0.1};
    CHECK_THROWS_AS(scatter({.box = cube(1), .wall = around}, 10, 1), ValueError);
    const Monitor cancelled{.report = {}, .cancelled = [] { return true; }};
    CHECK_THROWS_AS(scatter({.box = cube(1), .wall = {}}, 10, 1, cancelled), Interrupted);
}
