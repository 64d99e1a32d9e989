#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flow.h"
#include "support/FiniteDifference.h"
#include "support/Polynomial.h"
#include "support/Reference.h"

#include <bit>
#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

ScalarField noise(uint64_t seed) { return noiseField<Psrd3>({.seed = seed}, {.frequency = 1.5}); }

Flow boundFlow(const Sdf& sdf, Side side) {
    const Wall wall{.sdf = sdf, .side = side, .width = 0.15};
    return Flow(noise(1), bounded(noise(2), wall), Domain::of(wall));
}

struct Named {
    std::string name;
    Flow flow;
};

std::vector<Named> flows() {
    return {{"noise", Flow(noise(1), noise(2))},
            {"inside a sphere", boundFlow(sphereSdf(1), Side::inside)},
            {"around a torus", boundFlow(torusSdf(0.7, 0.3), Side::outside)},
            {"on both sides of a box", boundFlow(boxSdf({{1, 1.2, 0.8}}, 0.2), Side::both)},
            {"octaves",
             Flow(noiseField<Psrd3>({.seed = 3}, {.octaves = 3}), noiseField<Psrd3>({.seed = 4}, {.octaves = 2}))}};
}

Vec3d vec(const nlohmann::json& a) { return {{a.at(0).get<double>(), a.at(1).get<double>(), a.at(2).get<double>()}}; }

double frobenius(const Matrix3& m) {
    double sum = 0;
    for (const Vec3d& row : m.rows) sum += dot(row, row);
    return std::sqrt(sum);
}

double trace(const Matrix3& m) { return m.rows[0][0] + m.rows[1][1] + m.rows[2][2]; }

} // namespace

TEST_CASE("the example of ICN Fig. 3: c = (7/4, 0, -7/4)", "[flow]") {
    const Flow flow(formula([](const auto& x) { return x[0] * x[0] + x[1] * x[1] + x[2] * x[2]; }),
                    formula([](const auto& x) { return x[0] * x[0] * x[0] - x[1] * x[1] + x[2] * x[2] * x[2]; }));
    const FlowSample sample = flow.at({{0.5, 0.5, 0.5}});
    CHECK(sample.potentials == std::array{0.75, 0.0});
    CHECK(sample.velocity == Vec3d{{1.75, 0, -1.75}});
    // The derivative of c = (6 y z² + 4 y z, 6 x² z - 6 x z², -6 x² y - 4 x y) there.
    CHECK(sample.derivative == Matrix3{{Vec3d{{0, 3.5, 5}}, Vec3d{{1.5, 0, -1.5}}, Vec3d{{-5, -3.5, 0}}}});
}

TEST_CASE("flows of polynomials agree with the reference", "[flow]") {
    const auto file = reference("dfvn_polynomial_fields.json");
    if (!file) return;
    int rows = 0;
    for (const auto& row : file->at("rows")) {
        if (row.at("n") != 3) continue;
        ++rows;
        const Flow flow(polynomial(row["f"][0].get<std::string>()), polynomial(row["f"][1].get<std::string>()));
        const Vec3d p = vec(row["p_f64"]);
        const FlowSample sample = flow.at(p);
        CAPTURE(row.at("id").get<int>(), p, sample.velocity);
        // Sums of some twenty products below 20, each off by a few roundings.
        constexpr double kRounding = 20 * 20 * 8 * 0x1p-53;
        CHECK(std::abs(sample.potentials[0] - row["f_f64"][0].get<double>()) < kRounding);
        CHECK(std::abs(sample.potentials[1] - row["f_f64"][1].get<double>()) < kRounding);
        CHECK(length(sample.velocity - vec(row["c_f64"])) < kRounding);
        // c as a formula gives the derivative of c.
        for (size_t i = 0; i < 3; ++i) {
            const auto c = polynomial(row["c_expr"][i].get<std::string>()).at<1>(p);
            CHECK(length(sample.derivative.rows[i] - c.gradient) < 10 * kRounding);
        }
    }
    CHECK(rows >= 4);
}

TEST_CASE("the divergence of a flow is zero to rounding", "[flow]") {
    for (const auto& [name, flow] : flows()) {
        Worst worst;
        size_t moving = 0;
        for (const Vec3d& p : randomPoints(flow.domain().box.padded(0.1), 100000, 1)) {
            const FlowSample sample = flow.at(p);
            const double size = frobenius(sample.derivative);
            // Around one vertex in 289 the noises of two seeds have the same gradient; within 0.16 of it no other
            // vertex counts, f and g are multiples of one another, and all of the derivative is rounding.
            const auto f = flow.f().at<1>(p), g = flow.g().at<1>(p);
            if (length(sample.velocity) <= 1e-14 * length(f.gradient) * length(g.gradient)) continue;
            ++moving;
            // The trace is a sum of twelve products, each of which occurs twice with opposite sign.
            worst.see(std::abs(trace(sample.derivative)) / size, p);
        }
        CAPTURE(name, worst.value, worst.where);
        CHECK(moving > 99900);
        CHECK(worst.value <= 1e-9);
    }
}

TEST_CASE("the fluxes of the velocity through a small cube cancel, with second order", "[flow]") {
    // The trace above is zero by the symmetry of any Hessian, right or wrong; this is the divergence of the velocities.
    for (const auto& [name, flow] : flows()) {
        const auto divergence = [&](const Vec3d& p, double h) {
            double sum = 0;
            for (int axis = 0; axis < 3; ++axis)
                sum += (flow.at(p + unit(axis) * h).velocity - flow.at(p - unit(axis) * h).velocity)[axis] / (2 * h);
            return std::abs(sum);
        };
        std::vector<double> at1, at2;
        for (const Vec3d& p : randomPoints(flow.domain().box, 3000, 2)) {
            at1.push_back(divergence(p, 0x1p-10));
            at2.push_back(divergence(p, 0x1p-11));
        }
        const double order = observedOrder(median(at1), median(at2));
        CAPTURE(name, median(at1), median(at2), order);
        CHECK(order > 1.9);
        CHECK(order < 2.1);
    }
}

TEST_CASE("the derivative of a flow is that of its velocity", "[flow]") {
    for (const auto& [name, flow] : flows()) {
        const auto error = [&](const Vec3d& p, double h) {
            const Matrix3 derivative = flow.at(p).derivative;
            double worst = 0;
            for (int j = 0; j < 3; ++j) {
                const Vec3d column =
                    (flow.at(p + unit(j) * h).velocity - flow.at(p - unit(j) * h).velocity) * (0.5 / h);
                for (size_t i = 0; i < 3; ++i)
                    worst = std::max(worst, std::abs(column[static_cast<int>(i)] - derivative.rows[i][j]));
            }
            return worst;
        };
        std::vector<double> at1, at2;
        for (const Vec3d& p : randomPoints(flow.domain().box, 2000, 3)) {
            at1.push_back(error(p, 0x1p-10));
            at2.push_back(error(p, 0x1p-11));
        }
        const double order = observedOrder(median(at1), median(at2));
        CAPTURE(name, median(at1), median(at2), order);
        CHECK(order > 1.9);
        CHECK(order < 2.1);
        // h²/6 times third derivatives of c, products of derivatives up to the fourth: half of them are below 2 · 10^5
        // (seen: 1.1).
        CHECK(median(at2) < 0x1p-22 / 6 * 2e5);
    }
}

TEST_CASE("velocity is orthogonal to both gradients, and one function in every interface", "[flow]") {
    for (const auto& [name, flow] : flows()) {
        Worst worst;
        for (uint64_t batch = 0; batch < 50; ++batch) {
            PointBatch points;
            while (!points.full())
                points.push(randomPoint(flow.domain().box, batch, static_cast<uint64_t>(points.size)));
            Flow::Jets<double> jets;
            const auto& [f, g] = jets;
            VecBatch<double> c, again;
            VecBatch<float> single;
            flow.eval(points, jets, c);
            flow.velocity(points, again);
            flow.velocity(points, single);
            for (int i = 0; i < kBatch; ++i) {
                const Vec3d p = points[i];
                const double size = length(f[i].gradient) * length(g[i].gradient);
                worst.see(std::abs(dot(c[i], f[i].gradient)) / (size * length(f[i].gradient)), p);
                worst.see(std::abs(dot(c[i], g[i].gradient)) / (size * length(g[i].gradient)), p);
                const FlowSample sample = flow.at(p);
                CAPTURE(name, p);
                if (sample.velocity != c[i] || again[i] != c[i]) FAIL("velocities differ");
                if (sample.potentials[0] != f[i].value || sample.potentials[1] != g[i].value) FAIL("potentials differ");
                for (int axis = 0; axis < 3; ++axis)
                    if (std::abs(double(single[i][axis]) - c[i][axis]) > 0.01) FAIL("float differs"); // 5e-4 · 2 · 10
            }
        }
        CAPTURE(name, worst.where);
        CHECK(worst.value < 1e-15); // a few roundings
    }
}

TEST_CASE("nothing flows through a wall", "[flow]") {
    // On the zero level the velocity is orthogonal to ∇d: a few roundings of a velocity of 10 on a sphere, where d is a
    // rounding of 0 and α of third order in it.
    const Side side = GENERATE(Side::inside, Side::outside, Side::both);
    const Flow flow = boundFlow(sphereSdf(1), side);
    Worst flux, speed;
    for (uint64_t k = 0; k < 10000; ++k) {
        const Vec3d p = randomPoint(cube(1), 4, k), n = p * (1 / length(p));
        const Vec3d c = flow.at(n).velocity;
        flux.see(std::abs(dot(c, n)), n);
        speed.see(length(c), n);
    }
    CAPTURE(flux.value, flux.where);
    CHECK(speed.value > 1);
    CHECK(flux.value < 1e-14);
    // And through a whole wall that is not where d vanishes the fluxes add up to zero (Gauss), within the error of a
    // sum over 20,000 points: the total flux through a smaller sphere.
    constexpr int kCount = 20000;
    double total = 0, squares = 0;
    for (int k = 0; k < kCount; ++k) {
        // Fibonacci points: even, so that the sum converges faster than at random.
        const double z = 1 - (2 * k + 1.0) / kCount, r = std::sqrt(1 - z * z),
                     a = k * std::numbers::phi * 2 * std::numbers::pi;
        const Vec3d n{{r * std::cos(a), r * std::sin(a), z}};
        const double through = dot(flow.at(n * (side == Side::outside ? 1.1 : 0.9)).velocity, n);
        total += through;
        squares += through * through;
    }
    CAPTURE(total / kCount, std::sqrt(squares / kCount));
    CHECK(std::sqrt(squares / kCount) > 0.1);
    CHECK(std::abs(total / kCount) < 1e-3 * std::sqrt(squares / kCount));
}

TEST_CASE("speed is set as the root mean square over the domain", "[flow]") {
    for (const auto& [name, flow] : flows()) {
        CAPTURE(name);
        const Flow paced = withSpeed(flow, 2.5);
        const FlowMagnitudes before = magnitudesOf(flow), after = magnitudesOf(paced);
        CHECK(after.speed == Approx(2.5).epsilon(1e-12)); // the same samples: rounding only
        CHECK(after.potentials[1] == before.potentials[1]);
        CHECK(after.potentials[0] / before.potentials[0] == Approx(2.5 / before.speed));
        CHECK(paced.domain().box.lower == flow.domain().box.lower);
        CHECK(paced.domain().wall.has_value() == flow.domain().wall.has_value());
        // Other samples of the same domain: speeds vary by about their own size, so 5 / sqrt N.
        double squares = 0, count = 0;
        for (const Vec3d& p : randomPoints(flow.domain().box, 40000, 5)) {
            const auto& wall = flow.domain().wall;
            if (wall && !(beyondWall(wall->side, wall->sdf.distance.at<0>(p).value) < 0)) continue;
            const Vec3d c = paced.at(p).velocity;
            squares += dot(c, c);
            ++count;
        }
        CHECK(std::sqrt(squares / count) ==
              Approx(2.5).epsilon(5 / std::sqrt(count) + 5 / std::sqrt(131072 * count / 40000)));
        // The streamlines are the same: velocities differ by one factor.
        for (const Vec3d& p : randomPoints(flow.domain().box, 100, 6)) {
            const Vec3d c = flow.at(p).velocity * (2.5 / before.speed);
            CHECK(length(paced.at(p).velocity - c) <= 1e-14 * (1 + length(c)));
        }
    }
}

TEST_CASE("magnitudes are the same bits for any number of threads, and known in closed form", "[flow]") {
    const auto flow = boundFlow(sphereSdf(1), Side::inside);
    FlowMagnitudes one;
    {
        const ThreadLimit limit(1);
        one = magnitudesOf(flow);
    }
    const ThreadLimit limit(2);
    const FlowMagnitudes two = magnitudesOf(flow);
    CHECK(std::bit_cast<uint64_t>(one.speed) == std::bit_cast<uint64_t>(two.speed));
    CHECK(std::bit_cast<uint64_t>(one.potentials[0]) == std::bit_cast<uint64_t>(two.potentials[0]));
    CHECK(std::bit_cast<uint64_t>(one.potentials[1]) == std::bit_cast<uint64_t>(two.potentials[1]));
    // f = x, g = 2 y in the cube [-1, 1]: c = (0, 0, 2), mean of x² 1/3; 131,072 samples.
    const FlowMagnitudes simple = magnitudesOf(Flow(rampField({{1, 0, 0}}), rampField({{0, 2, 0}})));
    CHECK(simple.speed == 2);
    CHECK(simple.potentials[0] * simple.potentials[0] == Approx(1.0 / 3).epsilon(5 * 0.9 / std::sqrt(131072)));
    CHECK(simple.potentials[1] * simple.potentials[1] == Approx(4.0 / 3).epsilon(5 * 0.9 / std::sqrt(131072)));
}

TEST_CASE("a domain that is a small part of its box is found, an empty one is an error", "[flow]") {
    Wall wall{.sdf = sphereSdf(0.05), .side = Side::inside, .width = 0.02};
    const Flow small(noise(1), noise(2), {.box = cube(1), .wall = wall}); // 6.5e-5 of the box
    CHECK(magnitudesOf(small).speed > 0);
    wall.sdf = placed(wall.sdf, {.offset = {{5, 0, 0}}});
    const Flow empty(noise(1), noise(2), {.box = cube(1), .wall = wall});
    CHECK_THROWS_AS(magnitudesOf(empty), ValueError);
    CHECK_THROWS_AS(withSpeed(empty, 1), ValueError);
}

TEST_CASE("a pace that cannot be is an error", "[flow]") {
    const Flow flow(noise(1), noise(2));
    for (const double bad : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
        CAPTURE(bad);
        CHECK_THROWS_AS(withSpeed(flow, bad), ValueError);
    }
    CHECK_THROWS_AS(withSpeed(Flow(noise(1), noise(1)), 1), ValueError); // does not move
    const Monitor cancelled{.report = {}, .cancelled = [] { return true; }};
    CHECK_THROWS_AS(withSpeed(flow, 1, cancelled), Interrupted);
}
