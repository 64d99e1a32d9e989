// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/flow/Domain.h"
#include "support/FiniteDifference.h"

#include <numbers>
#include <set>

using namespace curlew;
using namespace curlew::test;

namespace {

Wall wallOf(const Sdf& sdf, Side side) { return {.sdf = sdf, .side = side, .width = 0.1}; }

using Cell = Vec<int, 3>;
struct Less {
    bool operator()(const Cell& a, const Cell& b) const { return a.c < b.c; }
};

} // namespace

TEST_CASE("Domain: the box of a wall is that of its shape with padding around obstacles", "[flow]") {
    const Sdf box = placed(boxSdf({{2, 4, 1}}, 0.1), {.offset = {{5, 0, 0}}});
    CHECK(Domain::of(wallOf(box, Side::inside)).box.lower == box.bounds.lower);
    CHECK(Domain::of(wallOf(box, Side::inside), 7).box.upper == box.bounds.upper);
    for (const Side side : {Side::outside, Side::both}) {
        const Domain domain = Domain::of(wallOf(box, side)), tight = Domain::of(wallOf(box, side), 0.25);
        CHECK(domain.box.lower == Vec3d{{2, -4, -2.5}}); // padded by half of the longest edge
        CHECK(domain.box.upper == Vec3d{{8, 4, 2.5}});
        CHECK(tight.box.lower == Vec3d{{3.75, -2.25, -0.75}});
        CHECK(tight.wall->side == side);
    }
    const Domain unbounded = Domain::of(wallOf(planeSdf({{0, 1, 0}}, 0), Side::inside));
    CHECK(unbounded.box.lower == Domain{}.box.lower);
    CHECK(unbounded.box.upper == Domain{}.box.upper);
    CHECK(unbounded.wall.has_value());
    CHECK_FALSE(Domain{}.wall.has_value());
}

TEST_CASE("beyondWall: is positive on the forbidden side only", "[flow]") {
    CHECK(beyondWall(Side::inside, 2) == 2);
    CHECK(beyondWall(Side::inside, -2) == -2);
    CHECK(beyondWall(Side::outside, 2) == -2);
    CHECK(beyondWall(Side::outside, -2) == 2);
    CHECK(beyondWall(Side::both, 2) == -2);
    CHECK(beyondWall(Side::both, -2) == -2);
    CHECK(beyondWall(Side::both, 0) == 0);
}

TEST_CASE("classify: allowed points remain allowed after rounding to float", "[flow]") {
    const Side side = GENERATE(Side::inside, Side::outside, Side::both);
    const Domain domain = Domain::of(wallOf(placed(sphereSdf(1), {.offset = {{30, 40, 0}}}), side));
    size_t allowedPoints = 0, near = 0;
    for (uint64_t batch = 0; batch < 100; ++batch) {
        PointBatch points;
        while (!points.full()) {
            // Half of the points are within a few float roundings of the wall.
            const auto k = static_cast<uint64_t>(points.size);
            Vec3d p = randomPoint(cube(1.5), batch, k);
            if (k % 2) p *= (1 + 1e-5 * (randomUniform(batch, k, 7) - 0.5)) / length(p);
            points.push(p + Vec3d{{30, 40, 0}});
        }
        std::array<bool, kBatch> allowed;
        std::array<double, kBatch> distance;
        classify(domain, points, allowed, distance);
        for (int i = 0; i < kBatch; ++i) {
            const auto k = static_cast<size_t>(i);
            const Vec3d p = points[i];
            const double d = domain.wall->sdf.distance.at<0>(p).value;
            CAPTURE(static_cast<int>(side), p, d);
            if (distance[k] != d) FAIL("distance");
            const double rounding = 71 * 0x1p-22; // twice the rounding of coordinates whose sum is below 71
            if (allowed[k] != (beyondWall(side, d) < 0) && std::abs(d) > rounding) FAIL("wrong");
            near += std::abs(d) < rounding;
            if (!allowed[k]) continue;
            ++allowedPoints;
            Vec3d rounded;
            for (int axis = 0; axis < 3; ++axis) rounded[axis] = static_cast<double>(static_cast<float>(p[axis]));
            const double after = domain.wall->sdf.distance.at<0>(rounded).value;
            if (!(beyondWall(side, after) < 0) || (after < 0) != (d < 0)) FAIL("changes sides in float");
        }
    }
    CHECK(allowedPoints > 400);
    CHECK(near > 1000);
}

TEST_CASE("classify: works in 2D and 5D", "[flow]") {
    const Side side = GENERATE(Side::inside, Side::outside, Side::both);
    const auto check = [&](auto dimension) {
        constexpr int N = dimension;
        CAPTURE(N, static_cast<int>(side));
        const WallN<N> wall{.sdf = sphereSdf<N>(2), .side = side, .width = 0.1};
        const DomainN<N> domain = DomainN<N>::of(wall), tight = DomainN<N>::of(wall, 0.5);
        for (int axis = 0; axis < N; ++axis) {
            CHECK(domain.box.upper[axis] == (side == Side::inside ? 2 : 4)); // padded by half of the longest edge
            CHECK(tight.box.lower[axis] == (side == Side::inside ? -2 : -2.5));
        }
        size_t within = 0, wrong = 0;
        for (uint64_t batch = 0; batch < 30; ++batch) {
            PointBatchN<N> points;
            while (points.size < kBatch - 5)
                points.push(randomPoint(cube<N>(3), batch, static_cast<uint64_t>(points.size)));
            points.push({});                       // the centre
            points.push(unit<N>(N - 1) * 2.0);     // on the wall
            points.push(unit<N>(0) * -(2 + 1e-7)); // close enough to be on the other side in float
            std::array<bool, kBatch> allowed;
            std::array<double, kBatch> distance;
            classify(domain, points, allowed, distance);
            for (int i = 0; i < points.size - 3; ++i) {
                const auto k = static_cast<size_t>(i);
                const double r = length(points[i]);
                within += r < 2;
                wrong += allowed[k] != (side == Side::both || (r < 2) == (side == Side::inside));
                wrong += !(std::abs(distance[k] - (r - 2)) < 1e-14);
            }
            const auto last = static_cast<size_t>(points.size);
            CHECK(allowed[last - 3] == (side != Side::outside));
            CHECK(distance[last - 3] == -2);
            CHECK_FALSE(allowed[last - 2]);
            CHECK_FALSE(allowed[last - 1]);
        }
        CHECK(wrong == 0);
        CHECK(within > 20);
        // Without a wall, each point is allowed.
        PointBatchN<N> one;
        one.push({});
        std::array<bool, kBatch> allowed;
        std::array<double, kBatch> distance;
        classify(DomainN<N>{}, one, allowed, distance);
        CHECK((allowed[0] && std::isinf(distance[0])));
    };
    check(std::integral_constant<int, 2>()); // a disc
    check(std::integral_constant<int, 5>());
}

TEST_CASE("classify: without a wall every point is allowed and with one NaN is not", "[flow]") {
    PointBatch points;
    points.push({{1e9, 0, 0}});
    points.push({{std::nan(""), 0, 0}});
    std::array<bool, kBatch> allowed;
    std::array<double, kBatch> distance;
    classify(Domain{}, points, allowed, distance);
    CHECK(allowed[0]);
    CHECK(std::isinf(distance[0]));
    classify(Domain::of(wallOf(sphereSdf(1), Side::both)), points, allowed, distance);
    CHECK(allowed[0]);
    CHECK_FALSE(allowed[1]);
}

TEST_CASE("coveringCells: cover every point in range and little else", "[flow]") {
    struct Case {
        const char* name;
        Sdf sdf;
        DistanceRange range;
    };
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const auto c = GENERATE_REF(values<Case>({
        {"inside", sphereSdf(0.9), {-kInfinity, 0}},
        {"shell", sphereSdf(0.9), {-0.05, 0.02}},
        {"outside of a torus", torusSdf(0.6, 0.25), {0, kInfinity}},
        {"turned box",
         placed(boxSdf({{1, 0.4, 0.8}}, 0.1), {.offset = {{0.1, 0.2, 0}}, .rotate = {{20, 30, 40}}}),
         {-kInfinity, 0.01}},
        {"gyroid", gyroidSdf(0.8, 0.1), {-kInfinity, 0}},
    }));
    const double size = GENERATE(0.05, 0.07);
    CAPTURE(c.name, size);
    const Domain domain{.box = {{{-1, -1.1, -0.9}}, {{1.03, 1, 0.8}}}, .wall = wallOf(c.sdf, Side::both)};
    const Vec3d origin{{0.013, -0.4, 3}};
    const auto cells = coveringCells(domain, origin, size, c.range, size_t{1} << 22);

    const std::set<Cell, Less> found(cells.begin(), cells.end());
    CHECK(found.size() == cells.size()); // no duplicates
    CHECK(std::is_sorted(cells.begin(), cells.end(), Less()));
    size_t inRange = 0;
    for (const Vec3d& p : randomPoints(domain.box, 100000, 1)) {
        const double d = c.sdf.distance.at<0>(p).value;
        if (d < c.range.lower || d > c.range.upper) continue;
        ++inRange;
        Cell cell;
        for (int axis = 0; axis < 3; ++axis) cell[axis] = static_cast<int>(std::floor((p[axis] - origin[axis]) / size));
        CAPTURE(p, d);
        if (!found.count(cell)) FAIL("a point in range is not covered");
    }
    CHECK(inRange > 500);
    // Few others: the centre of a cell is at most half a diagonal out of range, and each cell intersects the box.
    const double reach = size * std::numbers::sqrt3 / 2;
    for (const Cell& cell : cells) {
        Vec3d centre;
        for (int axis = 0; axis < 3; ++axis) centre[axis] = origin[axis] + size * (cell[axis] + 0.5);
        const double d = c.sdf.distance.at<0>(centre).value;
        CAPTURE(cell, d);
        if (d < c.range.lower - reach - 1e-12 || d > c.range.upper + reach + 1e-12) FAIL("a cell that is not needed");
        if (!domain.box.padded(size / 2 + 1e-12).contains(centre)) FAIL("a cell outside the box");
    }
}

TEST_CASE("coveringCells: the cell count of a shell scales with its area", "[flow]") {
    const Domain domain = Domain::of(wallOf(sphereSdf(1), Side::both), 0.5);
    const auto count = [&](double size) {
        return static_cast<double>(coveringCells(domain, {}, size, {0, 0}, size_t{1} << 24).size());
    };
    const double coarse = count(0.04), fine = count(0.02);
    CAPTURE(coarse, fine);
    CHECK(std::abs(fine / coarse - 4) < 0.2); // proportional to an area; a volume would give 8
    // A shell of area 4 pi that is sqrt 3 cells thick.
    CHECK(fine * 0.02 * 0.02 / (4 * std::numbers::pi) == Approx(std::numbers::sqrt3).epsilon(0.05));
}

TEST_CASE("coveringCells: without a wall the cells fill the box", "[flow]") {
    const Domain domain{.box = {{{0.01, 0.01, 0.01}}, {{0.99, 1.99, 0.49}}}, .wall = {}};
    CHECK(coveringCells(domain, {}, 0.25, {}, 1000).size() == 4 * 8 * 2);
    CHECK_THROWS_AS(coveringCells(domain, {}, 0.25, {}, 63), ResourceError);
    CHECK_NOTHROW(coveringCells(domain, {}, 0.25, {}, 64));
    const Domain empty{.box = {{{1, 1, 1}}, {{0, 0, 0}}}, .wall = {}};
    CHECK(coveringCells(empty, {}, 0.25, {}, 1000).empty());
}

TEST_CASE("coveringCells: invalid or too small cells are errors", "[flow]") {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    CHECK_THROWS_AS(coveringCells(Domain{}, {}, 1e-12, {}, 1000), ValueError); // more than 2^30 along an edge
    CHECK_THROWS_AS(coveringCells(Domain{.box = {{{0, 0, 0}}, {{1, kInfinity, 1}}}, .wall = {}}, {}, 0.1, {}, 1000),
                    ValueError);
    for (const double bad : {0.0, -0.1, std::nan(""), kInfinity}) {
        CAPTURE(bad);
        CHECK_THROWS_AS(coveringCells(Domain{}, {}, bad, {}, 1000), ValueError);
    }
    CHECK_THROWS_AS(coveringCells(Domain{.box = {{{0, 0, 0}}, {{1, std::nan(""), 1}}}, .wall = {}}, {}, 0.1, {}, 1000),
                    ValueError);
}
