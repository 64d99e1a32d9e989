// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/Algebra.h"
#include "curlew/flow/Flows.h"
#include "curlew/flow/Wind.h"
#include "curlew/track/FlowAtWall.h"
#include "curlew/track/FlowMap.h"
#include "curlew/track/Pathlines.h"
#include "curlew/track/Scatter.h"
#include "curlew/track/Splitting.h"
#include "support/FiniteDifference.h"
#include "support/Formula.h"
#include "support/MovingPoints.h"
#include "support/Points.h"

using namespace curlew;
using namespace curlew::test;

namespace {

const Domain kBox{.box = cube(3), .wall = {}};

/// Three terms of analytic fields without symmetries.
const Flow& smoothSum() {
    static const Flow flow = withSpeed(Flow(sinesF(), sinesG(), kBox) + uniformFlow({{0.5, 1, -0.5}}, kBox) +
                                           Flow(sinesG() * sinesF(), rampField({{1, 2, 0}}), kBox),
                                       1);
    return flow;
}

/// Curl noise whose potentials vanish linearly at the wall, so that each term is tangent to it.
Flow rampedCurl(const Wall& wall, double frequency = 1.5) {
    const ScalarField ramp = (2 / wall.width) * clipped(wall.sdf.distance, wall.width);
    const auto psi = [&](uint64_t seed) { return ramp * noiseField<Psrd3>({.seed = seed}, {.frequency = frequency}); };
    return curlFlow(std::array{psi(11), psi(12), psi(13)}, Domain::of(wall));
}

/// Four terms: noise bounded by Eq. 13, and curl noise whose potentials vanish at the wall.
Flow tangentSum(const Sdf& sdf, Side side) {
    const Wall wall{.sdf = sdf, .side = side, .width = 0.2};
    return withSpeed(boundFlow(sdf, side) + withSpeed(rampedCurl(wall), 1), 1);
}

Points movedBy(const Flow& flow, const std::vector<Vec3d>& points, const AdvectOptions& options) {
    Points particles = particlesAt(points);
    advect(flow, particles, options);
    return particles;
}

double medianDistance(const Points& a, const Points& b) {
    std::vector<double> distances;
    for (size_t k = 0; k < a.size(); ++k) distances.push_back(length(position(a, k) - position(b, k)));
    return median(distances);
}

struct Body {
    const char* name;
    Sdf sdf;
};

/// A ball with two fins of thickness 0.06.
Body finned() {
    const Sdf upright = boxSdf({{0.06, 1.8, 0.9}}, 0.02), level = boxSdf({{1.8, 0.06, 0.9}}, 0.02);
    return {"a ball with thin fins", unite(unite(sphereSdf(0.5), upright, 0.05), level, 0.05)};
}
/// Two balls at a distance of 0.1.
Body pair() {
    return {"two balls",
            unite(placed(sphereSdf(0.45), moved({{0.5, 0, 0}})), placed(sphereSdf(0.45), moved({{-0.5, 0, 0}})), 0.05)};
}

} // namespace

TEST_CASE("splitting: compositions are symmetric and each term covers the whole step", "[track]") {
    CHECK(compositionOf(Splitting::strang, 1) == std::vector<SplitFactor>{{0, 1}});
    CHECK(compositionOf(Splitting::strang, 2) == std::vector<SplitFactor>{{0, 0.5}, {1, 1}, {0, 0.5}});
    CHECK(compositionOf(Splitting::strang, 3) ==
          std::vector<SplitFactor>{{0, 0.5}, {1, 0.5}, {2, 1}, {1, 0.5}, {0, 0.5}});
    // Where two Strang steps meet, the first term's half steps are merged.
    CHECK(compositionOf(Splitting::yoshida, 2).size() == 7);
    for (const Splitting splitting : {Splitting::strang, Splitting::yoshida})
        for (size_t terms = 1; terms <= 5; ++terms) {
            const auto factors = compositionOf(splitting, terms);
            std::vector<double> total(terms);
            for (size_t k = 0; k < factors.size(); ++k) {
                const SplitFactor &first = factors[k], &last = factors[factors.size() - 1 - k];
                CAPTURE(terms, k);
                CHECK(first.term == last.term);
                CHECK(first.fraction == Approx(last.fraction).epsilon(1e-14));
                total[first.term] += first.fraction;
            }
            for (const double sum : total) CHECK(sum == Approx(1).epsilon(1e-14));
        }
    CHECK_THROWS_AS(compositionOf(Splitting::strang, 0), ValueError);
    CHECK_THROWS_AS(compositionOf(Splitting::none, 2), ValueError);
}

TEST_CASE("splitting: Strang is of second order and the triple jump of fourth", "[track]") {
    const auto points = randomPoints(cube(1), 200, 7);
    const Points exact = movedBy(smoothSum(), points, {.time = 0.8, .steps = 512, .splitting = Splitting::none});
    for (const auto& [splitting, order] : {std::pair{Splitting::strang, 2.0}, {Splitting::yoshida, 4.0}}) {
        const auto error = [&, splitting = splitting](int steps) {
            const AdvectOptions options{
                .time = 0.8, .steps = steps, .reprojection = {.tolerance = 1e-13}, .splitting = splitting};
            return medianDistance(movedBy(smoothSum(), points, options), exact);
        };
        const double coarse = error(16), fine = error(32);
        CAPTURE(order, coarse, fine, observedOrder(coarse, fine));
        CHECK(observedOrder(coarse, fine) > order - 0.2);
        CHECK(observedOrder(coarse, fine) < order + 0.3);
    }
}

TEST_CASE("splitting: volumes are preserved far better than positions", "[track]") {
    // Determinants of the map over one second in 10 steps, by central differences. Their own error is of second order
    // in h, so the result at h / 2 shows how much of the error is due to the differences.
    const auto points = randomPoints(cube(1), 60, 8);
    const auto offVolume = [&](double h) {
        std::vector<Vec3d> around;
        for (const Vec3d& p : points)
            for (int axis = 0; axis < 3; ++axis)
                for (const double side : {h, -h}) around.push_back(p + unit<3>(axis) * side);
        const Points end =
            movedBy(smoothSum(), around,
                    {.time = 1, .steps = 10, .reprojection = {.tolerance = 1e-13}, .splitting = Splitting::strang});
        std::vector<double> off;
        for (size_t k = 0; k < around.size(); k += 6) {
            std::array<Vec3d, 3> column;
            for (size_t axis = 0; axis < 3; ++axis)
                column[axis] = (position(end, k + 2 * axis) - position(end, k + 2 * axis + 1)) * (0.5 / h);
            off.push_back(std::abs(dot(column[0], cross(column[1], column[2])) - 1));
        }
        return median(off);
    };
    const double volume = std::min(offVolume(1e-4), offVolume(0.5e-4));
    const double place =
        medianDistance(movedBy(smoothSum(), points, {.time = 1, .steps = 10, .splitting = Splitting::strang}),
                       movedBy(smoothSum(), points, {.time = 1, .steps = 512, .splitting = Splitting::none}));
    CAPTURE(volume, place);
    CHECK(place > 3e-4);
    CHECK(volume < 0.02 * place);
}

TEST_CASE("splitting: the potentials of each term drift by at most the tolerance per substep", "[track]") {
    const Flow flow = tangentSum(sphereSdf(1), Side::inside);
    for (const Splitting splitting : {Splitting::strang, Splitting::yoshida})
        for (const double tolerance : {1e-5, 1e-10}) {
            Points particles = scatter(flow.domain(), 500, 3);
            const AdvectResult result = advect(flow, particles,
                                               {.time = 1,
                                                .steps = 16,
                                                .reprojection = {.tolerance = tolerance, .iterations = 40},
                                                .splitting = splitting});
            CAPTURE(static_cast<int>(splitting), tolerance, result.drift[0], result.drift[1]);
            CHECK(result.splitting == splitting);
            CHECK(result.drift[0] > 0);
            CHECK(result.drift[0] <= tolerance * (1 + 1e-12)); // for the rounding of the quotient
            CHECK(result.drift[1] <= tolerance * (1 + 1e-12));
            CHECK(result.substeps >= size_t{500} * 16 * 7);
            CHECK_FALSE(particles.hasTrack()); // a sum has no track
            for (size_t k = 0; k < particles.size(); ++k) {
                const Vec3d c = flow.at(position(particles, k)).velocity;
                REQUIRE(particles.vx[k] == static_cast<float>(c[0]));
                REQUIRE(particles.vz[k] == static_cast<float>(c[2]));
            }
        }
}

TEST_CASE("splitting: no particle of a sum of tangent terms crosses the wall for any step size", "[track]") {
    const auto body = GENERATE_COPY(values<Body>({{"a sphere", sphereSdf(1)}, finned(), pair()}));
    const Side side = GENERATE(Side::inside, Side::outside, Side::both);
    const Flow flow = tangentSum(body.sdf, side);
    CAPTURE(body.name, static_cast<int>(side));
    for (const AtWall& term : sumAtWall(flow, 500).terms) CHECK(term.tangent());
    const Points start = scatter(flow.domain(), 1000, 2);
    const auto distance = [&](const Points& p, size_t k) { return body.sdf.distance.at<0>(position(p, k)).value; };
    const auto changed = [&](const Points& p) {
        size_t count = 0;
        for (size_t k = 0; k < p.size(); ++k) count += (distance(p, k) < 0) != (distance(start, k) < 0);
        return count;
    };
    // Steps as long as the body, and steps shorter than the layer.
    for (const auto& [steps, scheme, splitting] : {std::tuple(4, Scheme::euler, Splitting::strang),
                                                   {4, Scheme::rk4, Splitting::none},
                                                   {32, Scheme::rk4, Splitting::none},
                                                   {32, Scheme::rk4, Splitting::strang},
                                                   {4, Scheme::rk4, Splitting::yoshida}}) {
        Points particles = start;
        const AdvectResult result =
            advect(flow, particles, {.time = 2, .steps = steps, .scheme = scheme, .splitting = splitting});
        CAPTURE(steps, result.notConverged, result.stalled, result.retries);
        CHECK(result.splitting == splitting);
        CHECK(result.outside == 0);
        CHECK(countOutside(flow.domain(), particles) == 0);
        CHECK(changed(particles) == 0);
        CHECK(medianDistance(particles, start) > 0.1);
        // Only few steps are discarded. This is not checked for a whole sum with steps as long as the body: it has no
        // track to return to, so even its smallest parts can end beyond the wall.
        if (splitting != Splitting::none || steps > 4)
            CHECK(result.stalled < start.size() * static_cast<size_t>(steps) * 7 / 20); // 7 factors or more per step
    }
    // Without reprojection particles of the same sum do leak, so this setup tests the guard.
    Points free = start;
    advect(flow, free,
           {.time = 2, .steps = 4, .scheme = Scheme::euler, .reprojection = {.method = Reprojection::none}});
    CHECK(changed(free) > 4);
}

TEST_CASE("splitting: no particle of a sum jumps through a plate thinner than its steps", "[track]") {
    const double half = 0.01;
    const Sdf plate = boxSdf({{40, 2 * half, 40}}, 0.004);
    const Domain domain{.box = {{{-1, -0.3, -1}}, {{1, 0.3, 1}}},
                        .wall = Wall{.sdf = plate, .side = Side::outside, .width = 0.1}};
    const Flow bound(noiseField<Psrd3>({.seed = 3}), bounded(noiseField<Psrd3>({.seed = 4}), *domain.wall), domain);
    const Flow wind = windFlow(*domain.wall, {}, {.direction = {{1, 0, 0}}, .across = Vec3d{{0, 0, 1}}});
    const Flow flow = withSpeed(withSpeed(bound, 1) + wind.within(domain) + rampedCurl(*domain.wall).within(domain), 1);
    std::vector<Vec3d> points;
    for (const Vec3d& p : randomPoints(domain.box, 2000, 5))
        if (std::abs(p[1]) > half + 1e-4) points.push_back(p);
    for (const auto& [steps, splitting] :
         {std::pair(4, Splitting::strang), {4, Splitting::none}, {16, Splitting::strang}, {64, Splitting::strang}}) {
        const Points end = movedBy(flow, points, {.time = 2, .steps = steps, .splitting = splitting});
        size_t jumped = 0;
        for (size_t k = 0; k < points.size(); ++k) jumped += (end.y[k] < 0) != (points[k][1] < 0);
        CAPTURE(steps);
        CHECK(jumped == 0);
        CHECK(countOutside(domain, end) == 0);
    }
}

TEST_CASE("splitting: terms that cross the wall are detected and particles wait at the wall", "[track]") {
    const Sdf sphere = sphereSdf(1);
    const Wall wall{.sdf = sphere, .side = Side::inside, .width = 0.2};
    const Domain domain = Domain::of(wall);
    const auto noise = [](uint64_t seed) { return noiseField<Psrd3>({.seed = seed}, {.frequency = 1.5}); };
    const Flow sum = boundFlow(sphere, Side::inside) + uniformFlow({{0, 2, 0}}, domain) +
                     Flow(noise(5), noise(6), domain) + rampedCurl(wall);
    const SumAtWall judged = sumAtWall(sum, 3000);
    const auto& terms = judged.terms;
    CHECK_FALSE(judged.whole.tangent());
    REQUIRE(terms.size() == 6);
    for (const size_t k : {0, 3, 4, 5}) {
        CAPTURE(k, terms[k].flux);
        CHECK(terms[k].tangent());
    }
    CHECK(terms[1].speed == Approx(2));
    CHECK(terms[1].flux <= 1 + 1e-12);
    CHECK(terms[1].flux > 0.995); // at the poles; one of 3000 points is close to them
    CHECK_FALSE(terms[1].tangent());
    CHECK_FALSE(terms[2].tangent());
    CHECK(terms[2].flux > 0.5);
    CHECK(sumAtWall(smoothSum()).terms.empty()); // no wall
    // The fluxes of two terms can cancel.
    const SumAtWall nothing =
        sumAtWall(rampedCurl(wall) + uniformFlow({{0, 1, 0}}, domain) + uniformFlow({{0, -1, 0}}, domain));
    CHECK(nothing.whole.tangent());
    CHECK_FALSE(nothing.terms[3].tangent());

    for (const Splitting splitting : {Splitting::none, Splitting::strang}) {
        Points particles = scatter(domain, 500, 9);
        const AdvectResult result = advect(sum, particles, {.time = 2, .steps = 20, .splitting = splitting});
        CHECK(result.outside == 0);
        CHECK(countOutside(domain, particles) == 0);
        CHECK(result.notConverged > 50);
    }
}

TEST_CASE("splitting: applies to sums that are not normalised", "[track]") {
    const Flow inWall = tangentSum(sphereSdf(1), Side::inside);
    CHECK(splittingOf(inWall, {}) == Splitting::none);
    CHECK(splittingOf(inWall, {.splitting = Splitting::yoshida}) == Splitting::yoshida);
    CHECK(splittingOf(boundFlow(sphereSdf(1), Side::inside), {.splitting = Splitting::strang}) == Splitting::none);
    const Flow even = inWall.normalized(1);
    CHECK(splittingOf(even, {}) == Splitting::none);
    CHECK_THROWS_WITH(splittingOf(even, {.splitting = Splitting::strang}), Catch::ContainsSubstring("normalised"));
}

TEST_CASE("splitting: long steps keep the density uniform and unsplit steps do not", "[track]") {
    const Flow flow = tangentSum(sphereSdf(1), Side::inside);
    const Points start = scatter(flow.domain(), 2000, 1);
    // Pearson's chi-squared test of the counts in six shells of the ball with equal volumes: 5 degrees of freedom.
    const auto chiSquared = [&](Splitting splitting) {
        Points p = start;
        advect(flow, p, {.time = 12, .steps = 40, .splitting = splitting});
        std::array<double, 6> shells{};
        for (size_t k = 0; k < p.size(); ++k)
            shells[static_cast<size_t>(std::min(5.0, std::floor(6 * std::pow(length(position(p, k)), 3))))] += 1;
        double sum = 0;
        for (const double n : shells) sum += (n - 2000 / 6.0) * (n - 2000 / 6.0) / (2000 / 6.0);
        return sum;
    };
    const double split = chiSquared(Splitting::strang), whole = chiSquared(Splitting::none);
    CAPTURE(split, whole);
    CHECK(split < 15.1);     // 99 %
    CHECK(whole > 2 * 15.1); // they cluster
}

TEST_CASE("splitting: steps adapt to the accuracy", "[track]") {
    const auto points = randomPoints(cube(1), 200, 10);
    const Points exact = movedBy(smoothSum(), points, {.time = 1, .steps = 1024, .splitting = Splitting::none});
    for (const Splitting splitting : {Splitting::strang, Splitting::yoshida}) {
        double before = 1;
        for (const double accuracy : {1e-3, 1e-4, 1e-5}) {
            const double error = medianDistance(movedBy(smoothSum(), points,
                                                        {.time = 1,
                                                         .steps = 1,
                                                         .scheme = Scheme::dormandPrince,
                                                         .splitting = splitting,
                                                         .accuracy = accuracy}),
                                                exact);
            CAPTURE(static_cast<int>(splitting), accuracy, error);
            CHECK(error < 30 * accuracy); // the errors of the steps add up; each is within the accuracy
            CHECK(error < 0.5 * before);
            before = error;
        }
    }
}

TEST_CASE("splitting: the result does not depend on threads or other particles or grouping of steps", "[track]") {
    const Flow flow = tangentSum(sphereSdf(1), Side::inside);
    const Points start = scatter(flow.domain(), 300, 3);
    const AdvectOptions options{.time = 0.5, .steps = 10, .splitting = Splitting::strang};
    Points one = start, two = start;
    {
        const ThreadLimit limit(1);
        advect(flow, one, options);
    }
    {
        const ThreadLimit limit(2);
        advect(flow, two, options);
    }
    CHECK(one.x == two.x);
    CHECK(one.z == two.z);
    CHECK(one.converged == two.converged);
    Points alone = particlesAt({position(start, 123)});
    advect(flow, alone, options);
    CHECK(position(alone, 0) == position(one, 123));
    Points along = start;
    const Pathlines pathlines = advectWithPathlines(FlowInTime(flow), along, 0, options);
    CHECK(medianDistance(along, one) < 1e-14);
    CHECK(pathlines.result.outside == 0);
    CHECK(pathlines.result.splitting == Splitting::strang);
    CHECK_FALSE(pathlines.curves.hasTrack());
}

TEST_CASE("splitting: particles of a changing sum stay in a moving wall", "[track]") {
    const FlowInTime flow([](double t) {
        const Sdf sphere = placed(sphereSdf(1), moved({{0.5 * t, 0, 0}}));
        const Wall wall{.sdf = sphere, .side = Side::inside, .width = 0.2};
        const Flow curl = rampedCurl(wall);
        return boundFlow(sphere, Side::inside) +
               (t < 0.5 ? curl : curl + curl); // also tests a changing number of terms
    });
    Points particles = scatter(flow.at(0).domain(), 200, 1);
    const AdvectResult result = advect(flow, particles, 0, {.time = 1, .steps = 8, .splitting = Splitting::strang});
    CHECK(result.outside == 0);
    CHECK(countOutside(flow.at(1).domain(), particles) == 0);
    CHECK(result.splitting == Splitting::strang);
    CHECK(result.notConverged < 10);
}

TEST_CASE("splitting: the flow map of a sum keeps both sides of a wall apart", "[track]") {
    const FlowMap map(FlowInTime(tangentSum(sphereSdf(1), Side::inside)), {.step = 0.1});
    std::vector<Vec3d> points = randomPoints(cube(1.1), 300, 6);
    const auto start = points;
    map.carry(points, 0, 1);
    size_t crossed = 0;
    double travelled = 0;
    for (size_t k = 0; k < points.size(); ++k) {
        crossed += (length(points[k]) < 1) != (length(start[k]) < 1);
        travelled += length(points[k] - start[k]) / 300;
    }
    CHECK(crossed == 0);
    CHECK(travelled > 0.2);
}

TEST_CASE("splitting: in 2D follows streamlines of the summed stream functions", "[track]") {
    // In 2D a sum of terms is a flow of one term, whose tracks are known.
    const auto f = formula<2>([](const auto& x) { return sin(x[0] * 2 + x[1]) + cos(x[1] * 3 - x[0]); });
    const auto g = formula<2>([](const auto& x) { return cos(x[0] - x[1] * 2) + sin(x[1]) * 2; });
    const DomainN<2> domain{.box = cube<2>(3), .wall = {}};
    const FlowN<2> whole({f + g}, domain), sum = FlowN<2>({f}, domain) + FlowN<2>({g}, domain);
    const auto end = [&](const FlowN<2>& flow, const AdvectOptions& options) {
        auto points = randomPoints(cube<2>(1), 100, 2);
        advect(flow, points, options);
        return points;
    };
    const auto exact = end(whole, {.time = 1, .steps = 500});
    const auto error = [&](int steps) {
        const auto points = end(sum, {.time = 1, .steps = steps, .splitting = Splitting::strang});
        std::vector<double> off;
        for (size_t k = 0; k < points.size(); ++k) off.push_back(length(points[k] - exact[k]));
        return median(off);
    };
    const double coarse = error(32), fine = error(64);
    CAPTURE(coarse, fine);
    CHECK(observedOrder(coarse, fine) == Approx(2).margin(0.25));
}
