// SPDX-License-Identifier: Apache-2.0
// Longer than 400 lines: Newton and Gauss-Newton, each with its limits and failures.
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Bound.h"
#include "curlew/field/NoiseField.h"
#include "curlew/track/Reproject.h"
#include "curlew/track/Stepper.h"
#include "support/FiniteDifference.h"
#include "support/Flows.h"
#include "support/Polynomial.h"
#include "support/Reference.h"
#include "support/Statistics.h"

#include <limits>
#include <set>

using namespace curlew;
using namespace curlew::test;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Landing {
    Vec3d position;
    double residualF, residualG;
    int iterations;
    bool converged;
};

template <int N>
struct LandingN {
    Vec<double, N> position;
    std::array<double, size_t{N - 1}> residual;
    int iterations;
    bool converged;
};

/// Reprojects a single point onto a track, in any dimension.
template <int N>
LandingN<N> land(const FlowN<N>& flow, const Vec<double, N>& from, const std::array<double, size_t{N - 1}>& values,
                 const ReprojectOptionsN<N>& options, double limit = kInfinity) {
    PointBatchN<N> points;
    points.push(from);
    TrackBatchN<N> track;
    for (size_t k = 0; k < values.size(); ++k) track[k][0] = values[k];
    std::array<double, kBatch> limits;
    limits.fill(limit);
    ReprojectedBatchN<N> result;
    reproject(flow, points, track, limits, options, result);
    LandingN<N> landing{points[0], {}, result.iterations[0], result.converged[0]};
    for (size_t k = 0; k < values.size(); ++k) landing.residual[k] = result.residual[k][0];
    return landing;
}

template <int N>
std::array<double, size_t{N - 1}> potentialsAt(const FlowN<N>& flow, const Vec<double, N>& p) {
    return flow.at(p).potentials;
}

template <int N>
ReprojectOptionsN<N> within(double tolerance, int iterations, Reprojection method = Reprojection::gaussNewton) {
    ReprojectOptionsN<N> options{.method = method, .iterations = iterations};
    options.tolerance.fill(tolerance);
    return options;
}

/// Returns the speed divided by the product of all gradient lengths. In 3D it is the sine of the angle between the
/// gradients. It is small if they are nearly dependent.
template <int N>
double independence(const FlowN<N>& flow, const Vec<double, N>& p) {
    double product = 1;
    for (const auto& f : flow.potentials()) product *= length(f.template at<1>(p).gradient);
    return length(flow.at(p).velocity) / product;
}

/// Reprojects a single point to f = f0, g = g0.
Landing land(const Flow& flow, const Vec3d& from, double f0, double g0, const ReprojectOptions& options,
             double limit = kInfinity) {
    PointBatch points;
    points.push(from);
    TrackBatch track;
    track[0][0] = f0;
    track[1][0] = g0;
    std::array<double, kBatch> limits;
    limits.fill(limit);
    ReprojectedBatch result;
    reproject(flow, points, track, limits, options, result);
    CHECK(points.size == 1);
    return {points[0], result.residual[0][0], result.residual[1][0], result.iterations[0], result.converged[0]};
}

const Flow& smoothFlow() {
    static const Flow flow(sinesF(), sinesG());
    return flow;
}

/// A point `off` at a distance of about `offset` from `on` and its track. The gradients there are neither parallel nor
/// small.
struct Displaced {
    Vec3d on, off;
    double f, g;
};
std::vector<Displaced> displaced(const Flow& flow, double offset, size_t count) {
    std::vector<Displaced> list;
    for (uint64_t k = 0; list.size() < count; ++k) {
        const Vec3d p = randomPoint(cube(1), 1, k);
        const auto f = flow.f().at<1>(p), g = flow.g().at<1>(p);
        const double c = length(flow.at(p).velocity);
        if (c < 0.5 * length(f.gradient) * length(g.gradient) || c < 2) continue;
        list.push_back({p, p + randomPoint(cube(offset), 2, k), f.value, g.value});
    }
    return list;
}

} // namespace

TEST_CASE("reproject: Gauss-Newton is exact on linear fields and takes the shortest way", "[track]") {
    // f = x, g = x + y: from the origin to f = 1, g = 3.
    const Flow flow(polynomial("x0"), polynomial("x0 + x1"));
    const Landing landing = land(flow, {{0, 0, 7}}, 1, 3, {});
    CHECK(landing.position == Vec3d{{1, 2, 7}});
    CHECK(landing.iterations == 1);
    CHECK(landing.converged);
    CHECK(landing.residualF == 0);
    // Newton corrects one function after the other (Eq. 12): first x to 1, then along (1, 1, 0) to x + y = 3.
    const Landing newton = land(flow, {{0, 0, 7}}, 1, 3, {.method = Reprojection::newton, .iterations = 1});
    CHECK(length(newton.position - Vec3d{{2, 1, 7}}) < 1e-15);
    CHECK_FALSE(newton.converged);
}

TEST_CASE("reproject: the Gauss-Newton step agrees with the reference minimum-norm solution", "[track]") {
    forRowsInDimensions("dfvn_minnorm.json", {2, 3, 4, 5, 6, 7}, [&](const nlohmann::json& row, auto dimension) {
        constexpr int N = dimension;
        const auto flow = [&]<size_t... K>(std::index_sequence<K...>) {
            return FlowN<N>(typename FlowN<N>::Potentials{rampField<N>(vec<N>(row["J_f64"][K]))...});
        }
        (std::make_index_sequence<size_t{N - 1}>());
        std::array<double, size_t{N - 1}> values;
        for (size_t k = 0; k < values.size(); ++k) values[k] = row["r_f64"][k].template get<double>();
        const auto landing = land<N>(flow, {}, values, {.iterations = 1});
        CAPTURE(row.at("id").get<int>(), landing.position);
        // Some dozens of rounding errors times the condition number, which is worse in higher dimensions.
        CHECK(length(landing.position - vec<N>(row["v_f64"])) < (N < 4 ? 1e-14 : 1e-12));
    });
}

TEST_CASE("reproject: converges quadratically", "[track]") {
    const Flow& flow = smoothFlow();
    for (const auto method : {Reprojection::gaussNewton, Reprojection::newton}) {
        // Residuals after k corrections, compared with those from half the offset: Gauss-Newton leaves a quarter after
        // one correction and 1/16 after two. Newton's first correction meets only the second function to second order,
        // unless the gradients are orthogonal; from then on, each correction squares the residual, too.
        const bool newton = method == Reprojection::newton;
        const auto residual = [&](double offset, int iterations) {
            std::vector<double> sizes;
            for (const auto& [on, off, f, g] : displaced(flow, offset, 300)) {
                const Landing l =
                    land(flow, off, f, g, {.method = method, .tolerance = {0, 0}, .iterations = iterations});
                sizes.push_back(newton && iterations == 1 ? std::abs(l.residualG)
                                                          : std::hypot(l.residualF, l.residualG));
            }
            return median(sizes);
        };
        const double one = observedOrder(residual(2e-3, 1), residual(1e-3, 1));
        const double two = observedOrder(residual(4e-2, 2), residual(2e-2, 2));
        const double three = observedOrder(residual(4e-2, 3), residual(2e-2, 3));
        CAPTURE(static_cast<int>(method), one, two, three);
        CHECK(one == Approx(2).margin(0.1));
        CHECK(two == Approx(newton ? 2 : 4).margin(0.3));
        if (newton) CHECK(three == Approx(4).margin(0.5));
    }
}

TEST_CASE("reproject: converges quadratically in every dimension", "[track]") {
    const auto check = [](const auto& flow, double offset, double independent) {
        constexpr int N = std::remove_cvref_t<decltype(flow)>::kDimension;
        CAPTURE(N);
        const auto residual = [&](double size, int iterations) {
            std::vector<double> sizes;
            for (uint64_t k = 0; sizes.size() < 200; ++k) {
                const auto on = randomPoint(cube<N>(1), 1, k);
                if (independence(flow, on) < independent) continue;
                const auto landing = land<N>(flow, on + randomPoint(cube<N>(size), 2, k), potentialsAt(flow, on),
                                             within<N>(0, iterations));
                double squares = 0;
                for (const double r : landing.residual) squares += r * r;
                sizes.push_back(std::sqrt(squares));
            }
            return median(sizes);
        };
        const double one = observedOrder(residual(offset, 1), residual(offset / 2, 1));
        const double two = observedOrder(residual(8 * offset, 2), residual(4 * offset, 2));
        CAPTURE(one, two);
        CHECK(one == Approx(2).margin(0.1));
        CHECK(two == Approx(4).margin(0.4));
    };
    check(flowOf<SineNoise<2>>({}), 1e-3, 0.5);
    check(flowOf<SineNoise<4>>({}), 1e-3, 0.3);
    check(flowOf<SimplexNoise<4>>({}), 1e-3, 0.3);
    check(flowOf<SineNoise<5>>({}), 1e-3, 0.2);
    check(flowOf<SineNoise<7>>({}), 5e-4, 0.1);
}

TEST_CASE("reproject: with steps of every scheme points stay on the track in every dimension", "[track]") {
    // ICN Algorithm 1. A point that does not return within the tolerance keeps its previous position, which is on the
    // track as well.
    const auto check = [](const auto& flow, double dt, Scheme scheme, Reprojection method) {
        constexpr int N = std::remove_cvref_t<decltype(flow)>::kDimension;
        constexpr double kTolerance = 1e-11;
        constexpr int kSteps = 40;
        CAPTURE(N, static_cast<int>(scheme), static_cast<int>(method));
        PointBatchN<N> from, to;
        while (!from.full()) from.push(randomPoint(cube<N>(0.5), 3, static_cast<uint64_t>(from.size)));
        const PointBatchN<N> start = from;
        PointBatchN<N> loose = from;
        TrackBatchN<N> track;
        for (size_t i = 0; i < kBatch; ++i) {
            const auto values = potentialsAt(flow, start[static_cast<int>(i)]);
            for (size_t k = 0; k < values.size(); ++k) track[k][i] = values[k];
        }
        std::array<double, kBatch> time, limit;
        time.fill(dt);
        StagesN<N> stages;
        ReprojectedBatchN<N> landed;
        const auto velocity = [&](const PointBatchN<N>& p, VecBatchN<double, N>& v) { flow.velocity(p, v); };
        size_t kept = 0;
        for (int s = 0; s < kSteps; ++s) {
            velocity(from, stages[0]);
            step(scheme, from, time, velocity, stages, to);
            for (int i = 0; i < kBatch; ++i) limit[static_cast<size_t>(i)] = length(to[i] - from[i]);
            reproject(flow, to, track, limit, within<N>(kTolerance, 20, method), landed);
            for (int i = 0; i < kBatch; ++i) {
                if (landed.converged[static_cast<size_t>(i)])
                    from.set(i, to[i]);
                else
                    ++kept;
            }
            velocity(loose, stages[0]);
            step(scheme, loose, time, velocity, stages, to);
            loose = to;
        }
        WorstN<N> drift;
        std::vector<double> free, moved;
        for (int i = 0; i < kBatch; ++i) {
            const auto now = potentialsAt(flow, from[i]), without = potentialsAt(flow, loose[i]);
            double worst = 0;
            for (size_t k = 0; k < now.size(); ++k) {
                drift.see(std::abs(now[k] - track[k][static_cast<size_t>(i)]), start[i]);
                worst = std::max(worst, std::abs(without[k] - track[k][static_cast<size_t>(i)]));
            }
            free.push_back(worst);
            moved.push_back(length(from[i] - start[i]));
        }
        CAPTURE(drift.value, drift.where, median(free), median(moved), kept);
        CHECK(drift.value <= kTolerance);
        CHECK(median(free) > 100 * kTolerance); // the integrator alone drifts off the track
        CHECK(median(moved) > 0.05);
        CHECK(kept < kBatch * kSteps / 10);
    };
    const auto polynomials4 = withSpeed(cubics<4>(), 1);
    const auto polynomials5 = withSpeed(cubics<5>(), 1);
    const auto noise4 = withSpeed(flowOf<SimplexNoise<4>>({}), 1);
    const auto noise5 = withSpeed(flowOf<SimplexNoise<5>>({}), 1);
    for (const auto method : {Reprojection::gaussNewton, Reprojection::newton}) {
        check(polynomials4, 0.02, Scheme::midpoint, method);
        check(noise4, 0.03, Scheme::euler, method);
        check(noise4, 0.05, Scheme::rk4, method);
    }
    check(polynomials5, 0.02, Scheme::midpoint, Reprojection::gaussNewton);
    check(noise5, 0.06, Scheme::euler, Reprojection::gaussNewton);
    check(noise5, 0.12, Scheme::rk4, Reprojection::gaussNewton);
    check(withSpeed(flowOf<SimplexNoise<2>>({}), 1), 0.02, Scheme::euler, Reprojection::newton);
    check(withSpeed(flowOf<SineNoise<7>>({}), 1), 0.02, Scheme::midpoint, Reprojection::gaussNewton);
    // A normalised flow has the same tracks.
    check(noise4.normalized(1), 0.02, Scheme::midpoint, Reprojection::gaussNewton);
}

TEST_CASE("reproject: Newton and Gauss-Newton are the same in 2D", "[track]") {
    // In 2D there is one potential, so Newton and Gauss-Newton are identical.
    const auto flow = flowOf<SineNoise<2>>({});
    for (uint64_t k = 0; k < 100; ++k) {
        const auto on = randomPoint(cube<2>(1), 4, k), off = on + randomPoint(cube<2>(0.02), 5, k);
        const auto track = potentialsAt(flow, on);
        const auto a = land<2>(flow, off, track, within<2>(1e-12, 20)),
                   b = land<2>(flow, off, track, within<2>(1e-12, 20, Reprojection::newton));
        CAPTURE(on, off);
        REQUIRE(a.iterations == b.iterations);
        REQUIRE(a.converged == b.converged);
        REQUIRE(length(a.position - b.position) < 1e-13);
    }
}

TEST_CASE("reproject: a sum of flows has no track and is refused", "[track]") {
    const auto check = [](const auto& flow) {
        constexpr int N = std::remove_cvref_t<decltype(flow)>::kDimension;
        const auto sum = flow + flow;
        const auto p = randomPoint(cube<N>(1), 6, 0);
        const auto track = potentialsAt(flow, p);
        for (const auto method : {Reprojection::newton, Reprojection::gaussNewton}) {
            CHECK_THROWS_AS((land<N>(sum, p, track, {.method = method})), ValueError);
            CHECK_THROWS_WITH((land<N>(sum, p, track, {.method = method})), Catch::ContainsSubstring("no tracks"));
        }
        // Without reprojection, only the velocity is computed.
        PointBatchN<N> points;
        points.push(p);
        ReprojectedBatchN<N> result;
        reproject(sum, points, TrackBatchN<N>{}, {}, {.method = Reprojection::none}, result);
        CHECK(points[0] == p);
        CHECK(result.velocity[0] == flow.at(p).velocity * 2.0);
    };
    check(flowOf<SineNoise<2>>({}));
    check(flowOf<SineNoise<3>>({}));
    check(flowOf<SineNoise<5>>({}));
}

TEST_CASE("reproject: both methods return to the track close to each other", "[track]") {
    const Flow& flow = smoothFlow();
    const double offset = 0.02, tolerance = 1e-11;
    for (const auto& [on, off, f, g] : displaced(flow, offset, 500)) {
        const ReprojectOptions options{.tolerance = {tolerance, tolerance}, .iterations = 100};
        ReprojectOptions newton = options;
        newton.method = Reprojection::newton;
        const Landing a = land(flow, off, f, g, options), b = land(flow, off, f, g, newton);
        CAPTURE(on, off, a.position, b.position, a.iterations, b.iterations);
        for (const Landing& l : {a, b}) {
            REQUIRE(l.converged);
            REQUIRE(std::abs(flow.f().at<0>(l.position).value - f) <= tolerance);
            REQUIRE(std::abs(flow.g().at<0>(l.position).value - g) <= tolerance);
            REQUIRE(l.residualF == flow.f().at<0>(l.position).value - f);
            REQUIRE(l.residualG == flow.g().at<0>(l.position).value - g);
        }
        REQUIRE(a.iterations <= 6);
        // Both corrections are combinations of the two gradients, so they differ along the track by second order only:
        // the square of the distance times a curvature of at most 12 (Hessians of 12, gradients above 1).
        const double distance = length(off - on);
        REQUIRE(length(a.position - b.position) < 12 * distance * distance + 1e-9);
        REQUIRE(length(a.position - off) <= 2 * distance);
    }
}

TEST_CASE("reproject: without correction the point stays and the residual is reported", "[track]") {
    const Flow& flow = smoothFlow();
    const auto d = displaced(flow, 0.02, 1)[0];
    const Landing l = land(flow, d.off, d.f, d.g, {.method = Reprojection::none});
    CHECK(l.position == d.off);
    CHECK(l.residualF == flow.f().at<0>(d.off).value - d.f);
    CHECK(l.iterations == 0);
    CHECK_FALSE(l.converged);
    // A point on the track needs no correction.
    const Landing still = land(flow, d.on, d.f, d.g, {});
    CHECK(still.position == d.on);
    CHECK(still.iterations == 0);
    CHECK(still.converged);
}

TEST_CASE("reproject: a correction is never longer than its limit", "[track]") {
    const Flow& flow = smoothFlow();
    const double limit = GENERATE(0.0, 1e-3, 0.05);
    for (const auto& [on, off, f, g] : displaced(flow, 0.3, 300)) {
        CAPTURE(on, off, limit);
        const double moved = length(land(flow, off, f, g, {.iterations = 1}, limit).position - off);
        REQUIRE(moved <= limit * (1 + 1e-12) + 1e-15);
        // Newton makes one correction for each of the two functions.
        const Landing newton = land(flow, off, f, g, {.method = Reprojection::newton, .iterations = 1}, limit);
        REQUIRE(length(newton.position - off) <= 2 * limit * (1 + 1e-12) + 1e-15);
        // The limit does not prevent it from iterating on.
        if (limit == 0.05)
            REQUIRE(land(flow, off, f, g, {.tolerance = {1e-9, 1e-9}, .iterations = 200}, limit).iterations > 0);
    }
}

TEST_CASE("reproject: parallel and vanishing gradients are handled", "[track]") {
    const auto finite = [](const Landing& l) {
        return std::isfinite(l.position[0]) && std::isfinite(l.position[1]) && std::isfinite(l.position[2]);
    };
    const auto method = GENERATE(Reprojection::gaussNewton, Reprojection::newton);
    CAPTURE(static_cast<int>(method));
    const ReprojectOptions options{.method = method};
    SECTION("parallel gradients with consistent values: the track is a surface") {
        const Flow flow(polynomial("x0"), polynomial("2*x0"));
        const Landing l = land(flow, {{0, 0, 0}}, 1, 2, options);
        CHECK(length(l.position - Vec3d{{1, 0, 0}}) < 1e-15);
        CHECK(l.converged);
    }
    SECTION("parallel gradients with contradictory values: no solution") {
        const Flow flow(polynomial("x0"), polynomial("2*x0"));
        const Landing l = land(flow, {{0, 0, 0}}, 1, 5, options);
        CHECK(finite(l));
        CHECK_FALSE(l.converged);
        CHECK(std::abs(l.position[0]) < 3);
    }
    SECTION("parallel gradients to within a microradian") {
        const Flow flow(polynomial("x0"), rampField({{2, 1e-7, 0}}));
        const Landing l = land(flow, {{0, 0, 0}}, 1, 5, options);
        CHECK(finite(l));
        CHECK(length(l.position) < 3); // not 10^7
    }
    SECTION("one gradient vanishes") {
        const Flow flow(polynomial("x0"), constantField(1));
        const Landing good = land(flow, {{0, 0, 0}}, 1, 1, options);
        CHECK(good.position == Vec3d{{1, 0, 0}});
        CHECK(good.converged);
        CHECK_FALSE(land(flow, {{0, 0, 0}}, 1, 2, options).converged);
    }
    SECTION("both gradients vanish") {
        const Flow flow(constantField(0), constantField(1));
        const Landing l = land(flow, {{1, 2, 3}}, 1, 2, options);
        CHECK(l.position == Vec3d{{1, 2, 3}});
        CHECK_FALSE(l.converged);
    }
    SECTION("NaN positions and values") {
        const Flow& flow = smoothFlow();
        CHECK_FALSE(land(flow, {{std::nan(""), 0, 0}}, 1, 2, options).converged);
        CHECK_FALSE(land(flow, {{0, 0, 0}}, std::nan(""), 2, options).converged);
    }
}

TEST_CASE("reproject: points of a batch do not influence each other", "[track]") {
    const auto method = GENERATE(Reprojection::none, Reprojection::gaussNewton, Reprojection::newton);
    CAPTURE(static_cast<int>(method));
    // A noise, so that the points need different numbers of corrections.
    const Wall wall{.sdf = sphereSdf(1), .side = Side::both, .width = 0.2};
    const Flow flow(noiseField<Psrd3>({.seed = 1}), bounded(noiseField<Psrd3>({.seed = 2}), wall));
    const ReprojectOptions options{.method = method, .tolerance = {1e-10, 1e-10}, .iterations = 7};
    std::set<int> iterations;
    for (uint64_t batch = 0; batch < 20; ++batch) {
        PointBatch points;
        TrackBatch track;
        std::array<double, kBatch> limit;
        while (!points.full()) {
            const auto k = static_cast<uint64_t>(points.size);
            const Vec3d p = randomPoint(cube(1.2), batch, k);
            track[0][k] = flow.f().at<0>(p).value;
            track[1][k] = flow.g().at<0>(p).value;
            limit[k] = 0.1 * randomUniform(batch, k, 9);
            points.push(p + randomPoint(cube(0.1 * randomUniform(batch, k, 8)), batch + 100, k));
        }
        const PointBatch before = points;
        ReprojectedBatch together;
        reproject(flow, points, track, limit, options, together);
        for (size_t k = 0; k < kBatch; ++k) {
            const int i = static_cast<int>(k);
            const Landing alone = land(flow, before[i], track[0][k], track[1][k], options, limit[k]);
            CAPTURE(batch, k);
            REQUIRE(alone.position == points[i]); // bitwise: this point is not NaN
            REQUIRE(alone.residualF == together.residual[0][k]);
            REQUIRE(alone.residualG == together.residual[1][k]);
            REQUIRE(alone.iterations == together.iterations[k]);
            REQUIRE(alone.converged == together.converged[k]);
            REQUIRE(flow.at(points[i]).velocity == together.velocity[i]);
            iterations.insert(alone.iterations);
        }
    }
    if (method != Reprojection::none) CHECK(iterations.size() > 3);
}

TEST_CASE("reproject: a single unchecked correction is second-order accurate", "[track]") {
    const Flow flow(noiseField<Psrd3>({.seed = 1}, {.frequency = 1.5}),
                    noiseField<Psrd3>({.seed = 2}, {.frequency = 1.5}));
    const auto start = randomPoints(cube(1), kBatch, 9);
    const auto off = [&](double by, Correction wanted) {
        PointBatch points;
        for (const Vec3d& p : start) points.push(p);
        FlowBatchN<3> here;
        flow.eval(points, here.potentials, here.velocity);
        const TrackBatch track{here.potentials[0].c[0], here.potentials[1].c[0]};
        for (int i = 0; i < points.size; ++i) points.set(i, points[i] + Vec3d{{by, -by, by}});
        const PointBatch moved = points;
        flow.eval(points, here.potentials, here.velocity);
        std::array<double, kBatch> limit;
        limit.fill(kInfinity);
        std::array<Correction, kBatch> all;
        all.fill(wanted);
        ReprojectedBatch result;
        reproject(flow, points, track, limit, within<3>(1e-12, 20), all, here, result);
        if (wanted == Correction::none) CHECK(points.c == moved.c);
        flow.eval(points, here.potentials, here.velocity);
        std::vector<double> left;
        for (size_t i = 0; i < kBatch; ++i) left.push_back(std::abs(here.potentials[0].c[0][i] - track[0][i]));
        return median(left);
    };
    const double coarse = off(1e-2, Correction::once), fine = off(5e-3, Correction::once);
    CAPTURE(coarse, fine);
    CHECK(coarse < 0.1 * off(1e-2, Correction::none));
    CHECK(observedOrder(coarse, fine) == Approx(2).margin(0.3));
    CHECK(off(1e-2, Correction::fully) < 1e-12);
}
