// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/Reproject.h"
#include "curlew/track/Stepper.h"
#include "support/FiniteDifference.h"
#include "support/Flows.h"
#include "support/Polynomial.h"
#include "support/Reference.h"

using namespace curlew;
using namespace curlew::test;

namespace {

/// Returns the position after `steps` equal steps. If `options` enable reprojection, it follows each step (ICN
/// Algorithm 1).
template <int N>
Vec<double, N> follow(const FlowN<N>& flow, Scheme scheme, const Vec<double, N>& start, double time, int steps,
                      const ReprojectOptionsN<N>& options = {.method = Reprojection::none}) {
    PointBatchN<N> from, to;
    from.push(start);
    TrackBatchN<N> track;
    for (size_t k = 0; k < track.size(); ++k) track[k][0] = flow.potentials()[k].template at<0>(start).value;
    StagesN<N> stages;
    ReprojectedBatchN<N> landed;
    std::array<double, kBatch> dt, limit;
    dt.fill(time / steps);
    const auto velocity = [&](const PointBatchN<N>& p, VecBatchN<double, N>& v) { flow.velocity(p, v); };
    for (int k = 0; k < steps; ++k) {
        velocity(from, stages[0]);
        step(scheme, from, dt, velocity, stages, to);
        limit[0] = length(to[0] - from[0]);
        if (options.method != Reprojection::none) {
            reproject(flow, to, track, limit, options, landed);
            if (!landed.converged[0]) FAIL("not converged");
        }
        from = to;
    }
    return from[0];
}

/// Compares the errors of `steps` and of twice as many: enough for the leading term to dominate, few enough to stay
/// above rounding.
void requireOrder(const Flow& flow, Scheme scheme, double order, const Vec3d& start, double time, const Vec3d& end,
                  int steps) {
    const double coarse = length(follow(flow, scheme, start, time, steps) - end);
    const double fine = length(follow(flow, scheme, start, time, 2 * steps) - end);
    CAPTURE(static_cast<int>(scheme), start, coarse, fine, observedOrder(coarse, fine));
    REQUIRE(fine > 1e-13); // above rounding, which would hide the order
    CHECK(observedOrder(coarse, fine) > order - 0.2);
    CHECK(observedOrder(coarse, fine) < order + 0.3);
}

const std::array<std::pair<Scheme, double>, 5> kSchemes{{{Scheme::euler, 1},
                                                         {Scheme::midpoint, 2},
                                                         {Scheme::rk4, 4},
                                                         {Scheme::bogackiShampine, 3},
                                                         {Scheme::dormandPrince, 5}}};

} // namespace

TEST_CASE("step: schemes have their order on streamlines in closed form", "[track]") {
    const auto [scheme, order] = GENERATE(from_range(kSchemes));
    const int steps = order > 4 ? 16 : 64;
    SECTION("rotation: f = x² + y² and g = z") {
        const Flow flow = Flow(polynomial("x0**2 + x1**2"), polynomial("x2"));
        const double t = 1.5, c = std::cos(2 * t), s = std::sin(2 * t);
        requireOrder(flow, scheme, order, {{1, 0.5, 0.25}}, t, {{c + 0.5 * s, 0.5 * c - s, 0.25}}, steps);
    }
    SECTION("hyperbola: f = x y and g = z") {
        const Flow flow = Flow(polynomial("x0*x1"), polynomial("x2"));
        requireOrder(flow, scheme, order, {{1, 2, 0.5}}, 2, {{std::exp(2), 2 * std::exp(-2), 0.5}}, steps);
    }
    SECTION("wave: f = y + sin(x) / 2 and g = z") {
        // c = (1, -cos(x) / 2, 0): the track is y0 - (sin(x0 + t) - sin x0) / 2.
        const Flow flow = Flow(formula([](const auto& x) { return x[1] + sin(x[0]) * 0.5; }), polynomial("x2"));
        const double x0 = 0.3, t = 4;
        requireOrder(flow, scheme, order, {{x0, 1, 0}}, t, {{x0 + t, 1 - (std::sin(x0 + t) - std::sin(x0)) / 2, 0}},
                     steps);
    }
}

TEST_CASE("step: schemes have their order on a flow without symmetry", "[track]") {
    const auto [scheme, order] = GENERATE(from_range(kSchemes));
    const Flow flow(sinesF(), sinesG());
    for (const Vec3d& start : {Vec3d{{0.1, 0.2, 0.3}}, Vec3d{{-0.5, 0.7, 0.1}}}) {
        // Converged to 1e-12 with at least 16 times as many steps.
        const Vec3d end = follow(flow, Scheme::dormandPrince, start, 0.5, 4096);
        requireOrder(flow, scheme, order, start, 0.5, end, order > 4 ? 128 : 64);
    }
}

TEST_CASE("step: streamlines agree with reference values", "[track]") {
    forRowsInDimensions("dfvn_exact_streamlines.json", {2, 3}, [&](const nlohmann::json& row, auto dimension) {
        constexpr int N = dimension;
        const FlowN<N> flow = flowOfRow<N>(row);
        const double time = row["t"].template get<double>();
        const auto start = vec<N>(row["x_start"]), end = vec<N>(row["x_end"]);
        // RK4 on a rotation by 2t has an error of 2t (2 dt)⁴ / 120.
        const int rk4Steps = static_cast<int>(128 * time);
        const double tolerance = 2 * time * std::pow(2.0 / 128, 4) / 120 * 4 + 1e-12;
        CAPTURE(row["id"].template get<int>());
        CHECK(length(follow(flow, Scheme::rk4, start, time, 8 * rk4Steps) - end) < tolerance / 1000 + 1e-12);
        for (const auto& [scheme, order] : kSchemes)
            for (const auto method : {Reprojection::none, Reprojection::newton, Reprojection::gaussNewton}) {
                ReprojectOptionsN<N> options{.method = method, .iterations = 50};
                options.tolerance.fill(1e-13);
                const int steps = order > 4 ? std::max(rk4Steps / 8, 4) : rk4Steps; // keeps the error above rounding
                const auto coarse = follow(flow, scheme, start, time, steps, options),
                           fine = follow(flow, scheme, start, time, 2 * steps, options);
                CAPTURE(static_cast<int>(scheme), static_cast<int>(method), length(coarse - end), length(fine - end));
                // With reprojection onto a circle, schemes can exceed their order, since only a phase error remains.
                const double observed = observedOrder(length(coarse - end), length(fine - end));
                CHECK(observed > order - 0.2);
                if (method == Reprojection::none) CHECK(observed < order + 0.4);
                if (scheme == Scheme::rk4) CHECK(length(coarse - end) < tolerance);
                if (method == Reprojection::none) continue;
                for (const auto& f : flow.potentials()) {
                    const double kept = f.template at<0>(start).value;
                    CHECK(std::abs(f.template at<0>(coarse).value - kept) <= 1e-13);
                    CHECK(std::abs(f.template at<0>(fine).value - kept) <= 1e-13);
                }
            }
    });
}

TEST_CASE("step: schemes have their order in other dimensions", "[track]") {
    const auto [scheme, order] = GENERATE(from_range(kSchemes));
    // Sines are smooth, so the full order is visible.
    const auto check = [scheme = scheme, order = order](const auto& flow) {
        constexpr int N = std::remove_cvref_t<decltype(flow)>::kDimension;
        std::vector<double> coarse, fine;
        for (const auto& start : randomPoints(cube<N>(0.5), 5, 1)) {
            const double time = 0.2 / length(flow.at(start).velocity);
            const auto end = follow(flow, Scheme::dormandPrince, start, time, 256);
            coarse.push_back(length(follow(flow, scheme, start, time, 32) - end));
            fine.push_back(length(follow(flow, scheme, start, time, 64) - end));
        }
        CAPTURE(N, static_cast<int>(scheme), median(coarse), median(fine));
        CHECK(observedOrder(median(coarse), median(fine)) > order - 0.25);
        // Dormand and Prince chose coefficients with a small leading term, so the next order is visible.
        CHECK(observedOrder(median(coarse), median(fine)) < order + (scheme == Scheme::dormandPrince ? 1 : 0.4));
    };
    check(flowOf<SineNoise<2>>({}));
    check(flowOf<SineNoise<4>>({}));
    check(flowOf<SineNoise<7>>({}));
    check(flowOf<SineNoise<2>>({}) + flowOf<SineNoise<2>>({.waves = 5})); // no tracks required
}

TEST_CASE("step: every point of a batch has its own time step", "[track]") {
    const Flow flow(sinesF(), sinesG());
    for (const auto& [scheme, order] : kSchemes) {
        PointBatch from, to;
        std::array<double, kBatch> dt;
        while (!from.full()) {
            const auto k = static_cast<uint64_t>(from.size);
            dt[k] = 0.1 * (randomUniform(1, k) - 0.5);
            from.push(randomPoint(cube(1), 2, k));
        }
        const auto velocity = [&](const PointBatch& p, VecBatch<double>& v) { flow.velocity(p, v); };
        StagesN<3> stages;
        flow.velocity(from, stages[0]);
        step(scheme, from, dt, velocity, stages, to);
        REQUIRE(to.size == kBatch);
        for (int i = 0; i < kBatch; ++i) {
            CAPTURE(static_cast<int>(scheme), i);
            CHECK(to[i] == follow(flow, scheme, from[i], dt[static_cast<size_t>(i)], 1));
        }
    }
}

TEST_CASE("Tableau: satisfies the order conditions", "[track]") {
    // For dx/dt = f(t): Σ b_i c_i^k = 1 / (k + 1) for k below the order, Σ_j a_ij = c_i, and an embedded solution of
    // one order less. The difference Σ e_i c_i^k therefore vanishes below that order.
    const auto scheme = static_cast<Scheme>(GENERATE(range(size_t{0}, kSchemeNames.size())));
    const Tableau& t = tableauOf(scheme);
    CAPTURE(kSchemeNames[static_cast<size_t>(scheme)]);
    const auto moment = [&](const std::array<double, Tableau::kMaxStages>& weights, int power) {
        double sum = 0;
        for (int i = 0; i <= t.stages; ++i)
            sum += weights[static_cast<size_t>(i)] * std::pow(i == 0 ? 0 : t.rows[static_cast<size_t>(i)].node, power);
        return sum;
    };
    const Tableau::Row& last = t.rows[static_cast<size_t>(t.stages)];
    for (int k = 0; k < t.order; ++k)
        CHECK(last.factor * moment(last.weights, k) == Approx(1.0 / (k + 1)).epsilon(1e-15));
    CHECK(last.weights[static_cast<size_t>(t.stages)] == 0); // the scheme is explicit
    for (int i = 1; i <= t.stages; ++i) {
        const Tableau::Row& row = t.rows[static_cast<size_t>(i)];
        CHECK(row.factor * moment(row.weights, 0) == Approx(row.node).epsilon(1e-14));
    }
    if (!t.embedded()) return;
    for (int k = 0; k + 1 < t.errorOrder; ++k) CHECK(std::abs(moment(t.error, k)) < 1e-15);
    CHECK(std::abs(moment(t.error, t.errorOrder - 1)) > 1e-4);
}

TEST_CASE("Tableau: an embedded pair estimates the error of its lower-order solution", "[track]") {
    const Flow flow = Flow(polynomial("x0**2 + x1**2"), polynomial("x2")); // rotates by 2 t
    // The weights of the lower-order solutions, as published.
    struct Case {
        Scheme scheme;
        std::array<double, Tableau::kMaxStages> weights;
        double step;
    };
    const auto [scheme, weights, step0] =
        GENERATE(Case{Scheme::bogackiShampine, {7.0 / 24, 1.0 / 4, 1.0 / 3, 1.0 / 8}, 0.02},
                 Case{Scheme::dormandPrince,
                      {5179.0 / 57600, 0, 7571.0 / 16695, 393.0 / 640, -92097.0 / 339200, 187.0 / 2100, 1.0 / 40},
                      0.1});
    const auto estimate = [&, scheme = scheme, weights = weights](double t) {
        PointBatch from, to;
        from.push({{1, 0.5, 0.25}});
        std::array<double, kBatch> dt;
        dt.fill(t);
        const auto velocity = [&](const PointBatch& p, VecBatch<double>& v) { flow.velocity(p, v); };
        StagesN<3> stages;
        velocity(from, stages[0]);
        step(scheme, from, dt, velocity, stages, to);
        VecBatch<double> last;
        velocity(to, last);
        const double estimated = std::abs(t) * length(estimatedDifference(scheme, 1, stages, last)[0]);
        Vec3d lower = from[0];
        for (size_t k = 0; k < weights.size(); ++k)
            if (weights[k] != 0) lower += stages[k][0] * (weights[k] * t);
        CHECK(estimated == Approx(length(to[0] - lower)).epsilon(1e-5));
        return estimated;
    };
    const int order = tableauOf(scheme).errorOrder;
    CHECK(observedOrder(estimate(step0), estimate(step0 / 2)) == Approx(order).margin(0.1));
    CHECK(estimate(-step0) > 0); // also backward
}

TEST_CASE("step: stages are evaluated at their nodes in time", "[track]") {
    // dx/dt = (p + 1) t^p is integrated exactly by a scheme of order p + 1.
    const auto [scheme, order] = GENERATE(from_range(kSchemes));
    PointBatch from, to;
    from.push({{1, 2, 3}});
    std::array<double, kBatch> dt;
    dt.fill(0.5);
    const int power = static_cast<int>(order) - 1;
    const auto velocity = [&](const PointBatch& p, double node, VecBatch<double>& v) {
        for (int i = 0; i < p.size; ++i) v.set(i, {{order * std::pow(node * 0.5, power), 0, 0}});
    };
    StagesN<3> stages;
    velocity(from, 0, stages[0]);
    step(scheme, from, dt, velocity, stages, to);
    CHECK(to[0][0] == Approx(1 + std::pow(0.5, order)).epsilon(1e-14));
}

TEST_CASE("stepsOf: takes at least one step for any time but zero", "[track]") {
    CHECK(stepsOf(0, 0.1) == 0);
    CHECK(stepsOf(1e-12, 0.1) == 1);
    CHECK(stepsOf(-1e-300, 0.1) == 1);
    CHECK(stepsOf(0.3, 0.1) == 3); // despite rounding
    CHECK(stepsOf(-0.31, 0.1) == 4);
    CHECK_THROWS_AS(stepsOf(std::nan(""), 0.1), ValueError);
}
