// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/base/Random.h"
#include "curlew/track/Neighbours.h"
#include "support/Points.h"

#include <limits>

using namespace curlew;
using namespace curlew::test;

namespace {

template <int N>
using Points = std::vector<Vec<double, N>>;

template <int N>
double distance(const Vec<double, N>& a, const Vec<double, N>& b) {
    return length(a - b);
}

/// Brute force over all pairs.
template <int N>
std::vector<double> nearestOfAll(const Points<N>& points) {
    std::vector<double> found(points.size(), std::numeric_limits<double>::infinity());
    for (size_t k = 0; k < points.size(); ++k)
        for (size_t j = 0; j < points.size(); ++j)
            if (j != k) found[k] = std::min(found[k], distance(points[j], points[k]));
    return found;
}

/// Returns a lattice with `edge` points along each axis and spacing 1.
template <int N>
Points<N> lattice(int edge) {
    Points<N> points(1);
    for (int axis = 0; axis < N; ++axis) {
        Points<N> more;
        for (const auto& p : points)
            for (int k = 0; k < edge; ++k) {
                more.push_back(p);
                more.back()[axis] = k;
            }
        points = std::move(more);
    }
    return points;
}

} // namespace

TEMPLATE_TEST_CASE_SIG("Neighbours: the point nearest to a position agrees with a search over all points", "[track]",
                       ((int N), N), 2, 3, 7) {
    const auto points = randomPoints(cube<N>(1), 400, 5), positions = randomPoints(cube<N>(1.5), 300, 6);
    const std::vector<uint32_t> found = NeighboursN<N>(points).nearest(positions);
    REQUIRE(found.size() == positions.size());
    for (size_t k = 0; k < positions.size(); ++k) {
        double least = std::numeric_limits<double>::infinity();
        for (const auto& p : points) least = std::min(least, distance(p, positions[k]));
        CHECK(distance(points[found[k]], positions[k]) == least);
    }
    CHECK(NeighboursN<N>(points).nearest({points[7]}) == std::vector<uint32_t>{7});
    CHECK_THROWS_AS(NeighboursN<N>({}).nearest(positions), ValueError);
}

TEMPLATE_TEST_CASE_SIG("Neighbours: nearest distances agree with a search over all pairs", "[track]", ((int N), N), 2,
                       3, 5, 7) {
    auto points = randomPoints(cube<N>(1), 500, 3);
    for (size_t k = 0; k < 50; ++k) points[k] *= 1e-6;                        // clustered
    for (size_t k = 100; k < 110; ++k) points[k] = points[k % 5 + 200];       // several at one position
    for (size_t k = 120; k < 140; ++k) points[k][N - 1] = points[120][N - 1]; // in one plane
    const std::vector<double> all = nearestOfAll(points), found = NeighboursN<N>(points).nearestDistances();
    REQUIRE(found.size() == 500);
    for (size_t k = 0; k < 500; ++k) {
        CAPTURE(k, points[k]);
        REQUIRE(found[k] == Approx(all[k]).epsilon(1e-12).margin(0));
    }
    const std::vector<double> some = NeighboursN<N>(points).nearestDistances(7);
    REQUIRE(some.size() == 72);
    for (size_t k = 0; k < some.size(); ++k) REQUIRE(some[k] == found[7 * k]);

    std::vector<double> sorted = all;
    std::sort(sorted.begin(), sorted.end());
    const Spacing spacing = spacingOf(points);
    CHECK(spacing.minimum == 0);
    CHECK(spacing.median == Approx(sorted[250]).epsilon(1e-12));
}

TEST_CASE("Neighbours: distances and counts on a lattice are known", "[track]") {
    const auto points = lattice<3>(8);
    const Spacing spacing = spacingOf(points);
    CHECK(spacing.median == 1);
    CHECK(spacing.minimum == 1);
    // Around an inner point: 6 at 1, 12 at √2, 8 at √3, 6 at 2.
    std::vector<double> bins(4);
    Neighbours(points).count((3 * 8 + 3) * 8 + 3, 0.51, bins);
    CHECK(bins == std::vector<double>{0, 6, 12, 14});
    // Counts are added to the existing ones.
    Neighbours(points).count(0, 0.51, bins);
    CHECK(bins == std::vector<double>{0, 9, 15, 18});
}

TEST_CASE("spacingOf: median and minimum of given distances", "[track]") {
    CHECK(spacingOf({3, 1, 2}).median == 2);
    CHECK(spacingOf({4, 3, 1, 2}).median == 3);
    CHECK(spacingOf({4, 3, 1, 2}).minimum == 1);
    CHECK(spacingOf(std::vector<double>{5}).minimum == 5);
}

TEST_CASE("Neighbours: many coincident points take no longer than distinct ones", "[track]") {
    // Brute force would compute 4e10 distances.
    Points<3> points(200000, {{1, 2, 3}});
    points.push_back({{2, 2, 3}});
    const std::vector<double> found = Neighbours(points).nearestDistances();
    CHECK(std::count(found.begin(), found.end(), 0.0) == 200000);
    CHECK(found.back() == 1);
}

TEST_CASE("Neighbours: does not depend on threads, accepts empty input and refuses invalid options", "[track]") {
    const auto points = randomPoints(cube<3>(1), 3000, 1);
    std::vector<double> one, two;
    {
        const ThreadLimit limit(1);
        one = Neighbours(points).nearestDistances();
    }
    {
        const ThreadLimit limit(2);
        two = Neighbours(points).nearestDistances();
    }
    CHECK(one == two);
    Points<3> few;
    CHECK(Neighbours(few).nearestDistances().empty());
    CHECK_THROWS_AS(spacingOf(few), ValueError);
    few.push_back({{1, 2, 3}});
    CHECK(Neighbours(few).nearestDistances() == std::vector{std::numeric_limits<double>::infinity()});
    CHECK_THROWS_AS(spacingOf(few), ValueError);
    few.push_back({{1, 2, 5}});
    CHECK(spacingOf(few).median == 2);
    CHECK_THROWS_AS(Neighbours(few).nearestDistances(0), ValueError);
    few.push_back({{1, std::numeric_limits<double>::quiet_NaN(), 5}});
    CHECK_THROWS_WITH(spacingOf(few), Catch::Matchers::ContainsSubstring("point 2"));
    CHECK_THROWS_AS(spacingOf(std::vector<double>{}), ValueError);
    Monitor monitor;
    monitor.cancelled = [] { return true; };
    CHECK_THROWS_AS(Neighbours(points).nearestDistances(1, monitor), Interrupted);
}

TEST_CASE("Neighbours: building the tree can be cancelled", "[track]") {
    std::vector<Vec<double, 3>> points(200000);
    for (size_t k = 0; k < points.size(); ++k)
        for (size_t axis = 0; axis < 3; ++axis) points[k].c[axis] = randomUniform(axis, k);
    CHECK_THROWS_AS(Neighbours(points, {.report = {}, .cancelled = [] { return true; }}), Interrupted);
}
