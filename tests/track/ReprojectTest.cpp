#include "curlew/field/Algebra.h"
#include "curlew/field/Bound.h"
#include "curlew/field/NoiseField.h"
#include "curlew/track/Reproject.h"
#include "support/FiniteDifference.h"
#include "support/Polynomial.h"
#include "support/Reference.h"

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

/// One point brought to f = f0, g = g0.
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

/// Points off the track of `on` by about `offset`, where the gradients are neither parallel nor small.
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

TEST_CASE("on linear fields Gauss-Newton is exact at once, and takes the shortest way", "[track]") {
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

TEST_CASE("the Gauss-Newton step is the minimum-norm solution of the reference", "[track]") {
    const auto file = reference("dfvn_minnorm.json");
    if (!file) return;
    int rows = 0;
    for (const auto& row : file->at("rows")) {
        if (row.at("n") != 3) continue;
        ++rows;
        const auto vec = [](const nlohmann::json& a) { return Vec3d{{a.at(0), a.at(1), a.at(2)}}; };
        const Flow flow(rampField(vec(row["J_f64"][0])), rampField(vec(row["J_f64"][1])));
        const Landing landing = land(flow, {}, row["r_f64"][0], row["r_f64"][1], {.iterations = 1});
        CAPTURE(row.at("id").get<int>());
        // Some dozens of roundings times the square of the condition number, at most 2 here.
        CHECK(length(landing.position - vec(row["v_f64"])) < 1e-14);
    }
    CHECK(rows > 0);
}

TEST_CASE("reprojection converges quadratically", "[track]") {
    const Flow& flow = smoothFlow();
    for (const auto method : {Reprojection::gaussNewton, Reprojection::newton}) {
        // Residuals after k corrections, from half the offset: Gauss-Newton leaves a quarter after one, 1/16 after two.
        // Newton one after the other is of first order while the gradients are not orthogonal: only the second function
        // is met to second order.
        const auto residual = [&](double offset, int iterations) {
            std::vector<double> sizes;
            for (const auto& [on, off, f, g] : displaced(flow, offset, 300)) {
                const Landing l =
                    land(flow, off, f, g, {.method = method, .tolerance = {0, 0}, .iterations = iterations});
                sizes.push_back(method == Reprojection::newton ? std::abs(l.residualG)
                                                               : std::hypot(l.residualF, l.residualG));
            }
            return median(sizes);
        };
        const double one = observedOrder(residual(2e-3, 1), residual(1e-3, 1));
        CAPTURE(static_cast<int>(method), one);
        CHECK(one == Approx(2).margin(0.1));
        if (method == Reprojection::newton) continue;
        const double two = observedOrder(residual(4e-2, 2), residual(2e-2, 2));
        CAPTURE(two);
        CHECK(two == Approx(4).margin(0.3));
    }
}

TEST_CASE("both methods come back onto the track, near each other", "[track]") {
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

TEST_CASE("without reprojection the point stays and the residual is told", "[track]") {
    const Flow& flow = smoothFlow();
    const auto d = displaced(flow, 0.02, 1)[0];
    const Landing l = land(flow, d.off, d.f, d.g, {.method = Reprojection::none});
    CHECK(l.position == d.off);
    CHECK(l.residualF == flow.f().at<0>(d.off).value - d.f);
    CHECK(l.iterations == 0);
    CHECK_FALSE(l.converged);
    // On the track there is nothing to do.
    const Landing still = land(flow, d.on, d.f, d.g, {});
    CHECK(still.position == d.on);
    CHECK(still.iterations == 0);
    CHECK(still.converged);
}

TEST_CASE("a correction is never longer than its limit", "[track]") {
    const Flow& flow = smoothFlow();
    const double limit = GENERATE(0.0, 1e-3, 0.05);
    for (const auto& [on, off, f, g] : displaced(flow, 0.3, 300)) {
        CAPTURE(on, off, limit);
        const double moved = length(land(flow, off, f, g, {.iterations = 1}, limit).position - off);
        REQUIRE(moved <= limit * (1 + 1e-12) + 1e-15);
        // Newton makes a correction for each of the two functions.
        const Landing newton = land(flow, off, f, g, {.method = Reprojection::newton, .iterations = 1}, limit);
        REQUIRE(length(newton.position - off) <= 2 * limit * (1 + 1e-12) + 1e-15);
        // It still arrives, if it may take enough of them.
        if (limit == 0.05)
            REQUIRE(land(flow, off, f, g, {.tolerance = {1e-9, 1e-9}, .iterations = 200}, limit).iterations > 0);
    }
}

TEST_CASE("parallel and vanishing gradients are guarded", "[track]") {
    const auto finite = [](const Landing& l) {
        return std::isfinite(l.position[0]) && std::isfinite(l.position[1]) && std::isfinite(l.position[2]);
    };
    const auto method = GENERATE(Reprojection::gaussNewton, Reprojection::newton);
    CAPTURE(static_cast<int>(method));
    const ReprojectOptions options{.method = method};
    SECTION("parallel and consistent: the track is a surface") {
        const Flow flow(polynomial("x0"), polynomial("2*x0"));
        const Landing l = land(flow, {{0, 0, 0}}, 1, 2, options);
        CHECK(length(l.position - Vec3d{{1, 0, 0}}) < 1e-15);
        CHECK(l.converged);
    }
    SECTION("parallel and contradictory: no solution") {
        const Flow flow(polynomial("x0"), polynomial("2*x0"));
        const Landing l = land(flow, {{0, 0, 0}}, 1, 5, options);
        CHECK(finite(l));
        CHECK_FALSE(l.converged);
        CHECK(std::abs(l.position[0]) < 3);
    }
    SECTION("parallel to within a microradian") {
        const Flow flow(polynomial("x0"), rampField({{2, 1e-7, 0}}));
        const Landing l = land(flow, {{0, 0, 0}}, 1, 5, options);
        CHECK(finite(l));
        CHECK(length(l.position) < 3); // not 10^7 away
    }
    SECTION("one gradient vanishes") {
        const Flow flow(polynomial("x0"), constantField(1));
        const Landing good = land(flow, {{0, 0, 0}}, 1, 1, options);
        CHECK(good.position == Vec3d{{1, 0, 0}});
        CHECK(good.converged);
        CHECK_FALSE(land(flow, {{0, 0, 0}}, 1, 2, options).converged);
    }
    SECTION("both vanish") {
        const Flow flow(constantField(0), constantField(1));
        const Landing l = land(flow, {{1, 2, 3}}, 1, 2, options);
        CHECK(l.position == Vec3d{{1, 2, 3}});
        CHECK_FALSE(l.converged);
    }
    SECTION("NaN") {
        const Flow& flow = smoothFlow();
        CHECK_FALSE(land(flow, {{std::nan(""), 0, 0}}, 1, 2, options).converged);
        CHECK_FALSE(land(flow, {{0, 0, 0}}, std::nan(""), 2, options).converged);
    }
}

TEST_CASE("no point of a batch influences another", "[track]") {
    const auto method = GENERATE(Reprojection::none, Reprojection::gaussNewton, Reprojection::newton);
    CAPTURE(static_cast<int>(method));
    // Noise, so that the points need different numbers of corrections.
    const Wall wall{.sdf = sphereSdf(1), .side = Side::both, .width = 0.2};
    const Flow flow(noiseField<Psrd3>({.seed = 1}), bounded(noiseField<Psrd3>({.seed = 2}), wall));
    const ReprojectOptions options{.method = method, .tolerance = {1e-10, 1e-10}, .iterations = 7};
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
        std::set<int> iterations;
        for (size_t k = 0; k < kBatch; ++k) {
            const int i = static_cast<int>(k);
            const Landing alone = land(flow, before[i], track[0][k], track[1][k], options, limit[k]);
            CAPTURE(batch, k);
            REQUIRE(alone.position == points[i]); // bitwise: no NaN here
            REQUIRE(alone.residualF == together.residual[0][k]);
            REQUIRE(alone.residualG == together.residual[1][k]);
            REQUIRE(alone.iterations == together.iterations[k]);
            REQUIRE(alone.converged == together.converged[k]);
            REQUIRE(flow.at(points[i]).velocity == together.velocity[i]);
            iterations.insert(alone.iterations);
        }
        if (method != Reprojection::none) CHECK(iterations.size() > 2);
    }
}
