// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/track/Jitter.h"
#include "support/FiniteDifference.h"
#include "support/Reference.h"

#include <limits>

using namespace curlew;
using namespace curlew::test;

namespace {

/// Returns the distance to the nearest point for some of the points, by brute force.
template <int N>
std::vector<double> nearestDistances(const std::vector<Vec<double, N>>& points, size_t queries) {
    std::vector<double> found(std::min(queries, points.size()));
    parallelFor(found.size(), 16, [&](size_t begin, size_t end) {
        for (size_t q = begin; q < end; ++q) {
            const size_t k = q * 7919 % points.size(); // a prime, to take queries from the whole lattice
            double least = std::numeric_limits<double>::infinity();
            for (size_t j = 0; j < points.size(); ++j) {
                const Vec<double, N> d = points[j] - points[k];
                if (j != k) least = std::min(least, dot(d, d));
            }
            found[q] = std::sqrt(least);
        }
    });
    return found;
}

/// The lattice of ICN §5.1, with 10 points along each axis of the unit cube.
template <int N>
DomainN<N> unitCube() {
    BoxN<N> box;
    for (int axis = 0; axis < N; ++axis) box.upper[axis] = 1;
    return {.box = box, .wall = {}};
}

template <int N>
std::vector<Vec<double, N>> jittered(uint64_t seed) {
    auto points = latticePoints(unitCube<N>(), 0.1);
    jitter(jitterFlow(unitCube<N>(), 0.1, {.seed = seed}), points, 0.1);
    return points;
}

/// A ball and the box of the lattice around it.
template <int N>
DomainN<N> ball(Side side) {
    return {.box = cube<N>(1), .wall = WallN<N>{.sdf = sphereSdf<N>(0.75), .side = side, .width = 0.2}};
}

} // namespace

TEST_CASE("meanNeighbourDistance: equals the mean over all lattice neighbours", "[track]") {
    CHECK(meanNeighbourDistance(1) == 1);
    for (int n = 2; n <= 7; ++n) {
        int all = 1;
        for (int axis = 0; axis < n; ++axis) all *= 3;
        double sum = 0;
        for (int k = 0; k < all; ++k) {
            int squared = 0;
            for (int axis = 0, rest = k; axis < n; ++axis, rest /= 3) squared += rest % 3 != 1;
            sum += std::sqrt(squared);
        }
        CHECK(meanNeighbourDistance(n) == Approx(sum / (all - 1)).epsilon(1e-14));
    }
    CHECK_THROWS_AS(meanNeighbourDistance(0), ValueError);
    const auto file = reference("cnj_mean_neighbour_distance.json");
    for (const auto& row : file.at("rows"))
        CHECK(meanNeighbourDistance(row["n"].get<int>()) == Approx(row["dbar_f64"].get<double>()).epsilon(1e-14));
}

TEST_CASE("latticePoints: fill the domain and are centred", "[track]") {
    const auto points = latticePoints(DomainN<2>{.box = {{{0, 1}}, {{1, 1.52}}}, .wall = {}}, 0.25);
    REQUIRE(points.size() == 8);
    CHECK(points[0][0] == Approx(0.125));
    CHECK(points[1][0] == Approx(0.375));
    CHECK(points[0][1] == Approx(1.135));
    CHECK(points[7][1] == Approx(1.385));
    CHECK(latticePoints(unitCube<5>(), 0.25).size() == 1024);
    CHECK(latticePoints(unitCube<3>(), 10).size() == 1);

    const auto inside = latticePoints(ball<3>(Side::inside), 0.05),
               outside = latticePoints(ball<3>(Side::outside), 0.05);
    CHECK(inside.size() + outside.size() == 64000);
    CHECK(std::all_of(inside.begin(), inside.end(), [](const Vec3d& p) { return length(p) < 0.75; }));
    CHECK(static_cast<double>(inside.size()) == Approx(14137).epsilon(0.02)); // the volume divided by that of a cell

    CHECK_THROWS_AS(latticePoints(unitCube<3>(), 0), ValueError);
    CHECK_THROWS_AS(latticePoints(unitCube<7>(), 1e-6), ResourceError);
    CHECK_THROWS_AS(latticePoints(DomainN<2>{.box = cube<2>(std::numeric_limits<double>::infinity()), .wall = {}}, 1),
                    ValueError);
}

TEST_CASE("jitter: nearest-neighbour distances match ICN Table 1", "[track]") {
    // ICN Table 1: the median distance to the nearest point for 10^n points at a spacing of 0.1, by curl noise and (for
    // u = 0.1) at random. Published with two digits. A single set of points deviates by about 1 %, a random one by 5 %
    // in 3D.
    const auto check = [](auto dimension, double byFlow, double atRandom, size_t queries) {
        constexpr int kN = decltype(dimension)::value;
        std::vector<double> found, random;
        for (const uint64_t seed : {1, 2, 3}) {
            const auto near = nearestDistances(jittered<kN>(seed), queries);
            found.insert(found.end(), near.begin(), near.end());
            auto points = latticePoints(unitCube<kN>(), 0.1);
            jitterRandomly(points, 0.1, 1, seed);
            const auto nearRandom = nearestDistances(points, queries);
            random.insert(random.end(), nearRandom.begin(), nearRandom.end());
        }
        const double leastFound = *std::min_element(found.begin(), found.end());
        const double leastRandom = *std::min_element(random.begin(), random.end());
        CAPTURE(kN, median(found), median(random), leastFound, leastRandom);
        CHECK(median(found) == Approx(byFlow).epsilon(0.03));
        CHECK(median(random) == Approx(atRandom).epsilon(0.06));
        CHECK(leastFound > 1.5 * leastRandom);
    };
    check(std::integral_constant<int, 3>(), 0.083, 0.069, 1000);
    check(std::integral_constant<int, 4>(), 0.081, 0.069, 1000);
}

TEST_CASE("jitter: the same step factor fits five dimensions", "[track]") {
    CHECK(median(nearestDistances(jittered<5>(1), 400)) == Approx(0.083).epsilon(0.03));
}

TEST_CASE("jitter: points move by the step along the flow", "[track]") {
    const double step = 0.016 * meanNeighbourDistance(3);
    const auto start = latticePoints(unitCube<3>(), 0.1);
    const auto flow = jitterFlow(unitCube<3>(), 0.1, {.seed = 4});
    for (const double amount : {1.0, -0.5, 0.0}) {
        auto points = start;
        const auto result = jitter(flow, points, 0.1, amount);
        CHECK(result.points == 1000);
        double sum = 0;
        for (size_t k = 0; k < start.size(); ++k) {
            const double moved = length(points[k] - start[k]);
            CAPTURE(amount, k);
            REQUIRE(moved <= std::abs(amount) * step * (1 + 1e-3));
            sum += moved / step;
        }
        CHECK(sum / 1000 == Approx(std::abs(amount)).epsilon(0.05)); // paths are slightly curved
    }
    // If the speed is not uniform, the flow is divergence-free, and the step is its root mean square.
    const auto free = jitterFlow(unitCube<3>(), 0.1, {.seed = 4, .uniform = false});
    CHECK(free.divergenceFree());
    CHECK_FALSE(flow.divergenceFree());
    auto points = start;
    jitter(free, points, 0.1);
    double squares = 0;
    for (size_t k = 0; k < start.size(); ++k) squares += dot(points[k] - start[k], points[k] - start[k]);
    CHECK(std::sqrt(squares / 1000) == Approx(step).epsilon(0.1));
    // Other seeds give other flows.
    auto one = start, two = start;
    jitter(jitterFlow(unitCube<3>(), 0.1, {.seed = 5}), one, 0.1);
    jitter(flow, two, 0.1);
    CHECK(one != two);
}

TEMPLATE_TEST_CASE_SIG("jitter: no point enters or leaves the domain in an animation", "[track]", ((int N), N), 2, 3) {
    // ICN Fig. 8. Lattice points on both sides of a wall move over 100 frames of a time-dependent flow. Points that
    // change sides between frames would pop in or out visibly.
    const double spacing = N == 2 ? 0.1 : 0.2;
    const DomainN<N> bounds = ball<N>(Side::both);
    const auto start = latticePoints(bounds, spacing);
    size_t stalled = 0;
    const auto pops = [&](const DomainN<N>& domain, int frames, int stride) {
        std::vector<bool> inside;
        size_t count = 0;
        for (const auto& p : start) inside.push_back(length(p) < 0.75);
        for (int frame = 0; frame < frames; frame += stride) {
            auto points = start;
            const auto flow = jitterFlow(domain, spacing, {.seed = 7, .time = frame / 24.0});
            stalled += jitter(flow, points, spacing).stalled;
            for (size_t k = 0; k < points.size(); ++k) {
                const bool now = length(points[k]) < 0.75;
                count += now != inside[k];
                inside[k] = now;
            }
        }
        return count;
    };
    CHECK(pops(bounds, 100, 1) == 0);
    CHECK(stalled == 0); // the flow itself turns along the wall
    CHECK(pops({.box = bounds.box, .wall = {}}, 300, 30) > 50);
}

TEST_CASE("jitterFlow: changes smoothly with time", "[track]") {
    const Vec3d p{{0.31, 0.47, 0.62}};
    const auto velocity = [&](double time) {
        return jitterFlow(unitCube<3>(), 0.1, {.seed = 1, .uniform = false, .time = time}).at(p).velocity;
    };
    const Vec3d now = velocity(1);
    const double far = length(velocity(1.02) - now), near = length(velocity(1.01) - now);
    CHECK(far > 1e-4);
    CHECK(near / far == Approx(0.5).margin(0.05));
    CHECK_NOTHROW(jitterFlow(unitCube<6>(), 0.5, {.time = 0.5}));
    CHECK_THROWS_AS(jitterFlow(unitCube<7>(), 0.5, {.time = 0.5}), ValueError);
}

TEST_CASE("jitter: does not depend on threads, accepts empty input and refuses invalid options", "[track]") {
    std::vector<Vec3d> one, two;
    {
        const ThreadLimit limit(1);
        one = jittered<3>(9);
    }
    {
        const ThreadLimit limit(2);
        two = jittered<3>(9);
    }
    CHECK(one == two);
    std::vector<Vec3d> none;
    const auto flow = jitterFlow(unitCube<3>(), 0.1);
    CHECK(jitter(flow, none, 0.1).points == 0);
    jitterRandomly(none, 0.1, 1, 0);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS_AS(jitter(flow, one, 0), ValueError);
    CHECK_THROWS_AS(jitter(flow, one, 0.1, nan), ValueError);
    CHECK_THROWS_AS(jitterRandomly(one, -1, 1, 0), ValueError);
    CHECK_THROWS_AS(jitterRandomly(one, 1, nan, 0), ValueError);
    CHECK_THROWS_AS(jitterFlow(unitCube<3>(), nan), ValueError);
    CHECK_THROWS_AS(jitterFlow(unitCube<3>(), 1, {.frequency = 0}), ValueError);
    CHECK_THROWS_AS(jitterFlow(unitCube<3>(), 1, {.time = nan}), ValueError);
}

TEST_CASE("jitteredLattice: gives the requested count inside the wall in 3D and in a plane", "[track]") {
    const Domain ball{.box = cube(1), .wall = Wall{.sdf = sphereSdf(0.8), .side = Side::inside}};
    const auto space = jitteredLattice(ball, {.count = 2000, .flow = {.seed = 3}});
    const auto plane = jitteredLattice(inPlane(ball), {.count = 2000, .flow = {.seed = 3}});
    for (const JitteredLattice& lattice : {space, plane}) {
        CHECK(lattice.conforms);
        CHECK(static_cast<double>(lattice.points.size()) == Approx(2000).epsilon(0.1));
        for (size_t k = 0; k < lattice.points.size(); ++k) {
            CHECK(lattice.points.id[k] == static_cast<int64_t>(k));
            CHECK(length(lattice.points.position(k)) < 0.8);
        }
    }
    CHECK(std::all_of(plane.points.z.begin(), plane.points.z.end(), [](double z) { return z == 0; }));
    const auto random = jitteredLattice(ball, {.spacing = 0.1, .random = true});
    CHECK(random.spacing == 0.1);
    CHECK(!random.conforms);
    const Domain elsewhere{.box = {{{2, 2, 2}}, {{3, 3, 3}}}, .wall = ball.wall};
    CHECK_THROWS_AS(jitteredLattice(elsewhere, {.spacing = 0.1}), ValueError);
    CHECK_THROWS_AS(jitteredLattice(elsewhere, {.count = 100}), ValueError);
}

TEST_CASE("inPlane: keeps the box, the wall and its width", "[track]") {
    const DomainN<2> plane =
        inPlane({.box = cube(1), .wall = Wall{.sdf = sphereSdf(0.8), .side = Side::outside, .width = 0.37}});
    CHECK(plane.box.upper == Vec<double, 2>{{1, 1}});
    CHECK(plane.wall->side == Side::outside);
    CHECK(plane.wall->width == 0.37);
    CHECK(plane.wall->sdf.distance.at<0>({{0, 1}}).value == Approx(0.2));
}
