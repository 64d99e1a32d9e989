#include "curlew/track/Stepper.h"
#include "support/FiniteDifference.h"
#include "support/Polynomial.h"
#include "support/Reference.h"

using namespace curlew;
using namespace curlew::test;

namespace {

/// Where `steps` equal steps lead.
Vec3d follow(const Flow& flow, Scheme scheme, const Vec3d& start, double time, int steps) {
    PointBatch from, to;
    from.push(start);
    VecBatch<double> first;
    std::array<double, kBatch> dt;
    dt.fill(time / steps);
    for (int k = 0; k < steps; ++k) {
        flow.velocity(from, first);
        step(
            scheme, from, first, dt, [&](const PointBatch& p, VecBatch<double>& v) { flow.velocity(p, v); }, to);
        from = to;
    }
    return from[0];
}

Vec3d vec(const nlohmann::json& a) {
    // Rows of two dimensions live in the plane z = 0.
    return {{a.at(0).get<double>(), a.at(1).get<double>(), a.size() > 2 ? a.at(2).get<double>() : 0}};
}

void requireOrder(const Flow& flow, Scheme scheme, double order, const Vec3d& start, double time, const Vec3d& end) {
    // From 64 to 128 steps; the order is that of the leading term, so a little off.
    const double coarse = length(follow(flow, scheme, start, time, 64) - end);
    const double fine = length(follow(flow, scheme, start, time, 128) - end);
    CAPTURE(static_cast<int>(scheme), start, coarse, fine, observedOrder(coarse, fine));
    REQUIRE(fine > 1e-13); // well above rounding, or there is no order to see
    CHECK(observedOrder(coarse, fine) > order - 0.2);
    CHECK(observedOrder(coarse, fine) < order + 0.3);
}

const std::array<std::pair<Scheme, double>, 3> kSchemes{{{Scheme::euler, 1}, {Scheme::midpoint, 2}, {Scheme::rk4, 4}}};

} // namespace

TEST_CASE("the schemes have their order on streamlines in closed form", "[track]") {
    const auto [scheme, order] = GENERATE(from_range(kSchemes));
    SECTION("rotation: f = x² + y², g = z") {
        const Flow flow = Flow(polynomial("x0**2 + x1**2"), polynomial("x2"));
        const double t = 1.5, c = std::cos(2 * t), s = std::sin(2 * t);
        requireOrder(flow, scheme, order, {{1, 0.5, 0.25}}, t, {{c + 0.5 * s, 0.5 * c - s, 0.25}});
    }
    SECTION("hyperbola: f = x y, g = z") {
        const Flow flow = Flow(polynomial("x0*x1"), polynomial("x2"));
        requireOrder(flow, scheme, order, {{1, 2, 0.5}}, 2, {{std::exp(2), 2 * std::exp(-2), 0.5}});
    }
    SECTION("wave: f = y + sin(x) / 2, g = z") {
        // c = (1, -cos(x) / 2, 0): a track of y0 - (sin(x0 + t) - sin x0) / 2.
        const Flow flow = Flow(formula([](const auto& x) { return x[1] + sin(x[0]) * 0.5; }), polynomial("x2"));
        const double x0 = 0.3, t = 4;
        requireOrder(flow, scheme, order, {{x0, 1, 0}}, t, {{x0 + t, 1 - (std::sin(x0 + t) - std::sin(x0)) / 2, 0}});
    }
}

TEST_CASE("the schemes have their order on a flow without symmetry", "[track]") {
    const auto [scheme, order] = GENERATE(from_range(kSchemes));
    const Flow flow(sinesF(), sinesG());
    for (const Vec3d& start : {Vec3d{{0.1, 0.2, 0.3}}, Vec3d{{-0.5, 0.7, 0.1}}}) {
        // Converged to 1e-12: RK4 with 32 times as many steps.
        const Vec3d end = follow(flow, Scheme::rk4, start, 0.5, 4096);
        requireOrder(flow, scheme, order, start, 0.5, end);
    }
}

TEST_CASE("streamlines agree with the reference", "[track]") {
    const auto file = reference("dfvn_exact_streamlines.json");
    if (!file) return;
    for (const auto& row : file->at("rows")) {
        const Flow flow(polynomial(row["f"][0].get<std::string>()),
                        polynomial(row["f"].size() > 1 ? row["f"][1].get<std::string>() : "x2"));
        const double time = row["t"].get<double>();
        CAPTURE(row["id"].get<int>());
        // RK4 on a rotation by 2t: an error of 2t (2 dt)⁴ / 120.
        const int steps = 2000;
        const double dt = time / steps, tolerance = 2 * time * std::pow(2 * dt, 4) / 120 * 4 + 1e-12;
        CHECK(length(follow(flow, Scheme::rk4, vec(row["x_start"]), time, steps) - vec(row["x_end"])) < tolerance);
    }
}

TEST_CASE("every point of a batch has its own time step, and none moves another", "[track]") {
    const Flow flow(sinesF(), sinesG());
    for (const Scheme scheme : {Scheme::euler, Scheme::midpoint, Scheme::rk4}) {
        PointBatch from, to;
        std::array<double, kBatch> dt;
        while (!from.full()) {
            const auto k = static_cast<uint64_t>(from.size);
            dt[k] = 0.1 * (randomUniform(1, k) - 0.5);
            from.push(randomPoint(cube(1), 2, k));
        }
        const auto velocity = [&](const PointBatch& p, VecBatch<double>& v) { flow.velocity(p, v); };
        VecBatch<double> first;
        flow.velocity(from, first);
        step(scheme, from, first, dt, velocity, to);
        REQUIRE(to.size == kBatch);
        for (int i = 0; i < kBatch; ++i) {
            CAPTURE(static_cast<int>(scheme), i);
            CHECK(to[i] == follow(flow, scheme, from[i], dt[static_cast<size_t>(i)], 1));
        }
    }
}
