// SPDX-License-Identifier: Apache-2.0
// Longer than 400 lines: divergence, walls and tracks are tested for each way to make a flow.
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/field/Transforms.h"
#include "curlew/flow/Flow.h"
#include "support/FlowChecks.h"
#include "support/Flows.h"
#include "support/Polynomial.h"
#include "support/Reference.h"

#include <bit>
#include <numbers>
#include <utility>

using namespace curlew;
using namespace curlew::test;

namespace {

ScalarField noise(uint64_t seed) { return noiseField<Psrd3>({.seed = seed}, {.frequency = 1.5}); }

Flow boundFlow(const Sdf& sdf, Side side) {
    const Wall wall{.sdf = sdf, .side = side, .width = 0.15};
    return Flow(noise(1), bounded(noise(2), wall), Domain::of(wall));
}

template <int N>
struct NamedN {
    std::string name;
    FlowN<N> flow;
};

std::vector<NamedN<3>> flows() {
    return {{"noise", Flow(noise(1), noise(2))},
            {"inside a sphere", boundFlow(sphereSdf(1), Side::inside)},
            {"around a torus", boundFlow(torusSdf(0.7, 0.3), Side::outside)},
            {"on both sides of a box", boundFlow(boxSdf({{1, 1.2, 0.8}}, 0.2), Side::both)},
            {"octaves",
             Flow(noiseField<Psrd3>({.seed = 3}, {.octaves = 3}), noiseField<Psrd3>({.seed = 4}, {.octaves = 2}))}};
}

template <int N>
ScalarFieldN<N> sines(uint64_t seed) {
    return noiseField<SineNoise<N>>({.seed = seed}, {.frequency = 0.5, .amplitude = 0.5});
}

/// The restriction of an M-dimensional flow to a graph over N of its coordinates, with N - 1 fields.
template <int N, int M>
FlowN<N> liftedFlow() {
    const auto graph = [&]<size_t... K>(std::index_sequence<K...>) {
        return std::array<ScalarFieldN<N>, size_t{M - N}>{sines<N>(K + 50)...};
    }
    (std::make_index_sequence<size_t{M - N}>());
    return [&]<size_t... K>(std::index_sequence<K...>) {
        return FlowN<N>(
            typename FlowN<N>::Potentials{lifted<N>(noiseField<SimplexNoise<M>>({.seed = K + 1}), graph)...});
    }
    (std::make_index_sequence<size_t{N - 1}>());
}

/// Several variants of one noise, and the other ways to make the fields of a flow in 3D.
std::vector<NamedN<3>> moreFlows() {
    const auto wallFlow = [](const Sdf& sdf, Side side) { return boundFlow(sdf, side); };
    const Sdf ball = sphereSdf(0.7), block = placed(boxSdf({{0.8, 0.9, 1}}, 0.25), {.offset = {{0.5, 0.2, 0}}});
    const auto blended = productBounded(noise(5), ball, 0.4);
    return {{"psrd, fast rotation", flowOf<Psrd3>({.alpha = 0.7, .rotation = PsrdOptions::Rotation::fast})},
            {"psrd, Perlin's grid, tiling",
             flowOf<Psrd3>({.period = {{3, 6, 3}}, .alpha = 2, .grid = PsrdOptions::Grid::perlin})},
            {"value noise", flowOf<ValueNoise<3>>({})},
            {"Perlin noise", flowOf<PerlinNoise<3>>({}, {.octaves = 2})},
            {"gradient noise", flowOf<GradientNoise<3>>({})},
            {"simplex noise", flowOf<SimplexNoise<3>>({})},
            {"simplex noise, cubed kernel", flowOf<SimplexNoise<3>>({.power = 3})},
            {"sines", flowOf<SineNoise<3>>({})},
            {"billow", flowOf<Psrd3>({}, {.octaves = 2, .billow = 0.2})},
            {"gradient-advected octaves", flowOf<SimplexNoise<3>>({}, {.octaves = 3, .warp = 0.1})},
            {"advected and folded", flowOf<SimplexNoise<3>>({}, {.octaves = 2, .billow = 0.2, .warp = -0.1})},
            {"displaced",
             Flow(displaced(noise(1), sines<3>(3), 0.1), displaced(noise(2), flowOf<SimplexNoise<3>>({}).f(), 0.05))},
            {"around a sphere", wallFlow(ball, Side::outside)},
            {"on both sides of a torus", wallFlow(torusSdf(0.7, 0.3), Side::both)},
            {"in a smooth union", wallFlow(unite(ball, block, 0.3), Side::inside)},
            {"in a smooth intersection", wallFlow(intersect(ball, block, 0.3), Side::both)},
            {"around a smooth difference", wallFlow(subtract(ball, block, 0.3), Side::outside)},
            {"on spheres", Flow(noise(1), sphereSdf(0.7).distance)},
            {"on tori", Flow(noise(1), torusSdf(0.7, 0.25).distance)},
            {"a product with the distance", Flow(blended, noise(6))},
            {"lifted from 4D", liftedFlow<3, 4>()},
            {"lifted from 5D", liftedFlow<3, 5>()},
            {"over a terrain", Flow(noise(1), heightField<3>(noiseField<Psrd2>()))},
            {"quotients and products", Flow(noise(1) / (noise(3) + constantField(3.0)), noise(2) * noise(4))},
            {"a sum of four", flows()[1].flow + flows()[4].flow + flowOf<SineNoise<3>>({}) + liftedFlow<3, 4>()}};
}

std::vector<NamedN<2>> planeFlows() {
    const auto potential = [](ScalarFieldN<2> f) { return FlowN<2>(FlowN<2>::Potentials{std::move(f)}); };
    const auto noise2 = noiseField<Psrd2>({.seed = 7}, {.frequency = 1.5});
    const auto inDisc = [&](Side side) {
        const WallN<2> wall{.sdf = sphereSdf<2>(0.8), .side = side, .width = 0.15};
        return FlowN<2>(FlowN<2>::Potentials{bounded(noise2, wall)}, DomainN<2>::of(wall));
    };
    return {{"psrd", flowOf<Psrd2>({.alpha = 1})},
            {"value noise", flowOf<ValueNoise<2>>({})},
            {"Perlin noise", flowOf<PerlinNoise<2>>({})},
            {"gradient noise", flowOf<GradientNoise<2>>({}, {.octaves = 3})},
            {"simplex noise", flowOf<SimplexNoise<2>>({})},
            {"sines", flowOf<SineNoise<2>>({})},
            {"gradient-advected octaves", flowOf<Psrd2>({}, {.octaves = 3, .warp = 0.1})},
            {"displaced", potential(displaced(noise2, noiseField<Psrd2>(), 0.1))},
            {"inside a disc", inDisc(Side::inside)},
            {"around a disc", inDisc(Side::outside)},
            {"on both sides of a disc", inDisc(Side::both)},
            {"a product with the distance", potential(productBounded(noise2, sphereSdf<2>(0.8), 0.3))},
            {"lifted from 3D", liftedFlow<2, 3>()},
            {"lifted from 4D", liftedFlow<2, 4>()},
            {"a sum", potential(noise2) + liftedFlow<2, 3>()}};
}

/// Requires that all interfaces give the same velocity, which is orthogonal to the gradients of a flow of one term.
template <int N>
void requireOneFunction(const FlowN<N>& flow, uint64_t batches) {
    WorstN<N> along, single;
    for (uint64_t batch = 0; batch < batches; ++batch) {
        PointBatchN<N> points;
        while (!points.full()) points.push(randomPoint(flow.domain().box, batch, static_cast<uint64_t>(points.size)));
        typename FlowN<N>::template Jets<double> jets;
        VecBatchN<double, N> c, again;
        VecBatchN<float, N> rounded;
        flow.eval(points, jets, c);
        flow.velocity(points, again);
        flow.velocity(points, rounded);
        for (int i = 0; i < kBatch; ++i) {
            const auto p = points[i];
            const auto sample = flow.at(p);
            CAPTURE(p);
            if (again[i] != c[i]) FAIL("velocities differ");
            // at() uses another formula for a normalised flow, which differs by some roundings.
            if (!(length(sample.velocity - c[i]) <= 1e-15 * flow.uniformSpeed())) FAIL("at() differs");
            double size = 1;
            for (size_t k = 0; k < jets.size(); ++k) {
                if (sample.potentials[k] != jets[k][i].value) FAIL("potentials differ");
                size *= length(jets[k][i].gradient);
            }
            if (flow.uniformSpeed() > 0) size = flow.uniformSpeed();
            for (size_t k = 0; k < jets.size() && flow.hasTracks(); ++k)
                if (const double gradient = length(jets[k][i].gradient); size * gradient > 0)
                    along.see(std::abs(dot(c[i], jets[k][i].gradient)) / (size * gradient), p);
            for (int axis = 0; axis < N; ++axis)
                single.see(std::abs(double(rounded[i][axis]) - c[i][axis]) / (size + 1), p);
        }
    }
    CAPTURE(along.value, along.where, single.value, single.where);
    CHECK(along.value < (flow.uniformSpeed() > 0 ? 1e-9 : 1e-15)); // a few roundings; more where c is small
    CHECK(single.value < 1e-3);
}

} // namespace

TEST_CASE("Flow: reproduces the example of ICN Fig. 3 with c = (7/4 0 -7/4)", "[flow]") {
    const Flow flow(formula([](const auto& x) { return x[0] * x[0] + x[1] * x[1] + x[2] * x[2]; }),
                    formula([](const auto& x) { return x[0] * x[0] * x[0] - x[1] * x[1] + x[2] * x[2] * x[2]; }));
    const FlowSample sample = flow.at({{0.5, 0.5, 0.5}});
    CHECK(sample.potentials == std::array{0.75, 0.0});
    CHECK(sample.velocity == Vec3d{{1.75, 0, -1.75}});
    // The derivative of c = (6 y z² + 4 y z, 6 x² z - 6 x z², -6 x² y - 4 x y) at that point.
    CHECK(sample.derivative == Matrix3{{Vec3d{{0, 3.5, 5}}, Vec3d{{1.5, 0, -1.5}}, Vec3d{{-5, -3.5, 0}}}});
}

TEST_CASE("Flow: polynomial flows agree with reference values in every dimension", "[flow]") {
    forRowsInDimensions(
        "dfvn_polynomial_fields.json", {2, 3, 4, 5, 6, 7}, [&](const nlohmann::json& row, auto dimension) {
            constexpr int N = dimension;
            const FlowN<N> flow = flowOfRow<N>(row);
            const auto p = vec<N>(row["p_f64"]);
            const auto sample = flow.at(p);
            double gradients = 1;
            for (size_t k = 0; k < FlowN<N>::kPotentials; ++k) {
                const auto jet = flow.potentials()[k].template at<1>(p);
                const auto gradient = [&](size_t i) { // a whole number or a fraction
                    const std::string text = row["gradients"][k][i].template get<std::string>();
                    const auto slash = text.find('/');
                    return std::stod(text) / (slash == text.npos ? 1 : std::stod(text.substr(slash + 1)));
                };
                for (int i = 0; i < N; ++i)
                    CHECK(jet.gradient[i] == Approx(gradient(static_cast<size_t>(i))).margin(1e-13));
                gradients *= length(jet.gradient);
                // Sums of fewer than twenty products below 100, each with a few rounding errors.
                CHECK(std::abs(sample.potentials[k] - row["f_f64"][k].template get<double>()) < 20 * 100 * 8 * 0x1p-53);
            }
            CAPTURE(row.at("id").get<int>(), p, sample.velocity, gradients);
            // Each component is a sum of at most (N - 1)! products of at most that size. Few are as large.
            CHECK(length(sample.velocity - vec<N>(row["c_f64"])) < 64 * 0x1p-53 * gradients);
            CHECK(std::abs(trace(sample.derivative)) < 1e-13 * productsIn(flow, p));
            // If the reference has a formula for c, its derivative is compared, too.
            if (row["c_expr"].is_null()) return;
            for (int i = 0; i < N; ++i) {
                const auto c = polynomial<N>(row["c_expr"][static_cast<size_t>(i)].template get<std::string>());
                CHECK(length(sample.derivative[i] - c.template at<1>(p).gradient) < 1e-13 * productsIn(flow, p));
            }
        });
}

TEST_CASE("Flow: the 2D velocity is f_y and -f_x", "[flow]") {
    // ICN §3.2: c equals ∇f × ∇z, restricted to its plane.
    const auto f = noiseField<Psrd2>({.seed = 3});
    const FlowN<2> flow(FlowN<2>::Potentials{f});
    const Flow above(projected(f, Matrix<2, 3>{}), rampField({{0, 0, 1}}));
    for (const auto& p : randomPoints(cube<2>(3), 1000, 1)) {
        CAPTURE(p);
        const auto gradient = f.at<1>(p).gradient;
        const auto c = flow.at(p).velocity;
        REQUIRE(c == Vec<double, 2>{{gradient[1], -gradient[0]}});
        REQUIRE(above.at({{p[0], p[1], 5}}).velocity == Vec3d{{c[0], c[1], 0}});
    }
}

TEST_CASE("Flow: divergence in 3D is zero to rounding", "[flow]") {
    for (const auto& list : {flows(), moreFlows()})
        for (const auto& [name, flow] : list) {
            CAPTURE(name);
            requireDivergenceFree(flow, flow.domain().box.padded(0.1));
        }
    // A field must be C³ to displace another one if the flow is to be C¹, and psrd in 3D is only C². Near the seams of
    // its third derivatives, in a part of space proportional to h, differences have jumps as large as the derivative.
    // The root mean square is about √h, with h = 1e-5 of the box.
    requireDivergenceFree(flowOf<Psrd3>({}, {.octaves = 3, .warp = 0.1}), cube(1), {.differences = 5e-3});
    requireDivergenceFree(Flow(displaced(noise(1), noise(3), 0.05), noise(2)), cube(1), {.differences = 5e-3});
}

TEST_CASE("Flow: divergence in 2D is zero to rounding", "[flow]") {
    for (const auto& [name, flow] : planeFlows()) {
        CAPTURE(name);
        requireDivergenceFree(flow, flow.domain().box.padded(0.5));
    }
}

TEST_CASE("Flow: divergence in 4D to 7D is zero to rounding", "[flow]") {
    SECTION("4D") {
        requireDivergenceFree(flowOf<SimplexNoise<4>>({}), cube<4>(1));
        requireDivergenceFree(flowOf<SineNoise<4>>({}, {.octaves = 2}), cube<4>(1), {.count = 5000});
        requireDivergenceFree(liftedFlow<4, 5>(), cube<4>(1), {.count = 5000});
        requireDivergenceFree(liftedFlow<4, 6>(), cube<4>(1), {.count = 2000});
        const WallN<4> wall{.sdf = sphereSdf<4>(1), .side = Side::both, .width = 0.15};
        auto walled = flowOf<SimplexNoise<4>>({}).potentials();
        walled[1] = bounded(walled[1], wall);
        requireDivergenceFree(FlowN<4>(walled), cube<4>(1), {.count = 5000});
        requireDivergenceFree(FlowN<4>(walled) + flowOf<SineNoise<4>>({}), cube<4>(1), {.count = 5000});
    }
    SECTION("5D") {
        requireDivergenceFree(flowOf<SimplexNoise<5>>({}), cube<5>(1));
        requireDivergenceFree(flowOf<SineNoise<5>>({}), cube<5>(1), {.count = 5000});
        requireDivergenceFree(liftedFlow<5, 6>(), cube<5>(1), {.count = 1000});
        requireDivergenceFree(flowOf<SimplexNoise<5>>({}, {.octaves = 2, .warp = 0.05}), cube<5>(1), {.count = 1000});
    }
    SECTION("6D and 7D") {
        requireDivergenceFree(flowOf<SimplexNoise<6>>({.kernel = SimplexKernel::corners}), cube<6>(1),
                              {.count = 5000, .still = 0.1});
        requireDivergenceFree(flowOf<SimplexNoise<6>>({}), cube<6>(1), {.count = 2000});
        requireDivergenceFree(flowOf<SineNoise<6>>({}), cube<6>(1), {.count = 5000});
        requireDivergenceFree(flowOf<SimplexNoise<7>>({}), cube<7>(1), {.count = 500});
        requireDivergenceFree(flowOf<SineNoise<7>>({}), cube<7>(1), {.count = 5000});
    }
}

TEST_CASE("Flow: fluxes through a small cube cancel with second order", "[flow]") {
    // The trace above is zero because any Hessian is symmetric, even a wrong one. This tests the divergence of the
    // velocities themselves.
    for (const auto& [name, flow] : flows()) {
        // Medians, since a few points straddle a seam of the third derivatives, where the order is one.
        const auto divergence = [&flow = flow](double h) {
            std::vector<double> sizes;
            for (const Vec3d& p : randomPoints(flow.domain().box, 3000, 2))
                sizes.push_back(divergenceFd(flow, {p, p}, 1, 1, h));
            return median(sizes);
        };
        const double at1 = divergence(0x1p-11), at2 = divergence(0x1p-12), order = observedOrder(at1, at2);
        CAPTURE(name, at1, at2, order);
        CHECK(order > 1.9);
        CHECK(order < 2.1);
    }
}

TEST_CASE("Flow: the Jacobian agrees with central differences of the velocity", "[flow]") {
    for (const auto& [name, flow] : flows()) {
        CAPTURE(name);
        requireJacobian(flow, flow.domain().box, 2000, 3);
        requireJacobian(flow.normalized(2), flow.domain().box, 500, 3, 0x1p-12);
    }
    for (const auto& [name, flow] : moreFlows()) {
        CAPTURE(name);
        requireJacobian(flow, flow.domain().box, 300, 3, 0x1p-12);
    }
    requireJacobian(flowOf<Psrd3>({}, {.octaves = 3, .warp = 0.1}), cube(1), 300, 3, 0x1p-12);
    requireJacobian(Flow(displaced(noise(1), noise(3), 0.05), noise(2)), cube(1), 300, 3, 0x1p-12);
    requireJacobian(flowOf<SimplexNoise<3>>({.power = 3}, {.octaves = 2, .warp = 0.1}), cube(1), 300, 3, 0x1p-12);
    for (const auto& [name, flow] : planeFlows()) {
        CAPTURE(name);
        requireJacobian(flow, flow.domain().box, 500, 3, 0x1p-12);
        requireJacobian(flow.normalized(2), flow.domain().box, 500, 3, 0x1p-13);
    }
    requireJacobian(cubics<4>(), cube<4>(1), 300, 3);
    requireJacobian(flowOf<SimplexNoise<4>>({}), cube<4>(1), 300, 3);
    requireJacobian((cubics<4>() + flowOf<SimplexNoise<4>>({})).normalized(3), cube<4>(1), 300, 3, 0x1p-13);
    requireJacobian(cubics<5>(), cube<5>(1), 200, 3);
    requireJacobian(flowOf<SimplexNoise<5>>({}), cube<5>(1), 100, 3);
    requireJacobian(cubics<6>(), cube<6>(1), 50, 3);
    requireJacobian(cubics<7>(), cube<7>(1), 20, 3);
}

TEST_CASE("Flow: velocity is orthogonal to all gradients and the same in every interface", "[flow]") {
    for (const auto& list : {flows(), moreFlows()})
        for (const auto& [name, flow] : list) {
            CAPTURE(name);
            requireOneFunction(flow, 20);
            requireOneFunction(flow.normalized(3), 5);
        }
    for (const auto& [name, flow] : planeFlows()) {
        CAPTURE(name);
        requireOneFunction(flow, 20);
        requireOneFunction(flow.normalized(3), 5);
    }
    requireOneFunction(flowOf<SimplexNoise<4>>({}), 20);
    requireOneFunction(flowOf<SimplexNoise<4>>({}).normalized(0.5), 20);
    requireOneFunction(flowOf<SimplexNoise<5>>({}), 10);
    requireOneFunction(flowOf<SineNoise<6>>({}), 10);
    requireOneFunction(flowOf<SineNoise<7>>({}), 5);
}

TEST_CASE("Flow: a sum adds velocities and keeps the first domain and has no tracks", "[flow]") {
    const Flow a = boundFlow(sphereSdf(1), Side::inside), b(noise(3), noise(4), {.box = cube(5), .wall = {}});
    const Flow sum = a + b, more = sum + b;
    CHECK(a.hasTracks());
    CHECK_FALSE(sum.hasTracks());
    CHECK(sum.divergenceFree());
    CHECK(sum.terms().size() == 2);
    CHECK(more.terms().size() == 3);
    CHECK(sum.domain().wall->width == a.domain().wall->width);
    CHECK(sum.domain().box.upper == a.domain().box.upper);
    CHECK_FALSE((b + a).domain().wall.has_value());
    for (const Vec3d& p : randomPoints(cube(1), 1000, 1)) {
        const auto one = a.at(p), two = b.at(p), both = sum.at(p), three = more.at(p);
        CAPTURE(p);
        REQUIRE(both.velocity == one.velocity + two.velocity);
        REQUIRE(length(three.velocity - (one.velocity + two.velocity * 2.0)) <= 1e-15 * length(three.velocity) + 1e-13);
        REQUIRE(both.potentials == one.potentials); // those of the first term
        for (int i = 0; i < 3; ++i) REQUIRE(both.derivative[i] == one.derivative[i] + two.derivative[i]);
    }
}

TEST_CASE("Flow.normalized: keeps the direction at one speed and reports divergence", "[flow]") {
    const auto check = [](const auto& flow, double speed, const auto& box) {
        constexpr int N = std::remove_cvref_t<decltype(flow)>::kDimension;
        const FlowN<N> same = flow.normalized(speed);
        CHECK_FALSE(same.divergenceFree());
        CHECK(same.uniformSpeed() == speed);
        CHECK(same.hasTracks() == flow.hasTracks());
        CHECK(same.terms().size() == flow.terms().size());
        WorstN<N> direction, size;
        double divergences = 0, derivatives = 0;
        for (const auto& p : randomPoints(box, 5000, 1)) {
            const auto c = flow.at(p).velocity;
            const auto sample = same.at(p);
            direction.see(length(sample.velocity - c * (speed / length(c))) / speed, p);
            size.see(std::abs(length(sample.velocity) / speed - 1), p);
            divergences += std::pow(trace(sample.derivative), 2);
            derivatives += std::pow(frobenius(sample.derivative), 2);
        }
        CAPTURE(speed, direction.where, size.where);
        CHECK(direction.value < 1e-14);
        CHECK(size.value < 1e-14);
        CHECK(divergences > 0.01 * derivatives);
    };
    check(flows()[0].flow, 2.5, cube(1));
    check(flows()[1].flow, 1e-3, cube(1));
    check(flows()[3].flow + flows()[0].flow, 7.0, cube(1));
    check(planeFlows()[0].flow, 1e6, cube<2>(1));
    check(flowOf<SimplexNoise<5>>({}), 1.0, cube<5>(1));
    // If a flow is normalised twice, the last speed applies.
    CHECK(flows()[0].flow.normalized(2).normalized(3).uniformSpeed() == 3);
}

TEST_CASE("Flow.normalized: keeps its speed in float for weak and strong potentials", "[flow]") {
    for (const double factor : {1e-30, 1e-22, 1e-12, 1.0, 1e15, 1e25, 1e35}) {
        const Flow flow = Flow(factor * noise(1), noise(2)).normalized(2);
        PointBatch points;
        while (!points.full()) points.push(randomPoint(cube(1), 1, static_cast<uint64_t>(points.size)));
        VecBatch<float> c;
        VecBatch<double> exact;
        flow.velocity(points, c);
        flow.velocity(points, exact);
        Worst speed, direction;
        for (int i = 0; i < kBatch; ++i) {
            Vec3d single;
            for (int axis = 0; axis < 3; ++axis) single[axis] = static_cast<double>(c[i][axis]);
            speed.see(std::abs(length(single) - 2), points[i]);
            direction.see(length(single - exact[i]), points[i]);
        }
        CAPTURE(factor, speed.where, direction.where);
        CHECK(speed.value < 1e-6);
        CHECK(direction.value < 1e-3); // the noises' own rounding, relative to a small c
    }
}

TEST_CASE("Flow.normalized: is zero where the flow is zero", "[flow]") {
    // A vortex: f = x² + y², g = z. On its axis the direction is undefined.
    const Flow flow = Flow(polynomial("x0**2 + x1**2"), polynomial("x2")).normalized(3);
    CHECK(flow.at({{0, 0, 0.5}}).velocity == Vec3d{});
    CHECK(frobenius(flow.at({{0, 0, 0.5}}).derivative) > 0); // the derivative of c itself, which is finite
    CHECK(std::isfinite(frobenius(flow.at({{0, 0, 0.5}}).derivative)));
    CHECK(length(flow.at({{1e-9, 0, 0.5}}).velocity - Vec3d{{0, -3, 0}}) < 1e-14);
    // Elsewhere the closed form is 3 (y, -x) / r. The derivative of its first component is 3 (-x y, x²) / r³.
    const auto sample = flow.at({{3, 4, 0}});
    CHECK(length(sample.velocity - Vec3d{{2.4, -1.8, 0}}) < 1e-15);
    CHECK(length(sample.derivative[0] - Vec3d{{-36.0 / 125, 27.0 / 125, 0}}) < 1e-15);
    PointBatch points;
    points.push({{0, 0, 0.5}});
    VecBatch<double> c;
    flow.velocity(points, c);
    CHECK(c[0] == Vec3d{});
}

TEST_CASE("Flow: changing the domain does not change the velocity", "[flow]") {
    const Wall wall{.sdf = sphereSdf(1), .side = Side::outside, .width = 0.3};
    const Domain domain = Domain::of(wall, 2);
    for (const Flow& flow : {flows()[0].flow, flows()[0].flow + flows()[4].flow, flows()[0].flow.normalized(4)}) {
        const Flow moved = flow.within(domain);
        CHECK(moved.domain().box.upper == domain.box.upper);
        CHECK(moved.domain().wall->side == Side::outside);
        CHECK_FALSE(flow.domain().wall.has_value()); // the original flow is unchanged
        CHECK(moved.uniformSpeed() == flow.uniformSpeed());
        CHECK(moved.hasTracks() == flow.hasTracks());
        for (const Vec3d& p : randomPoints(cube(1), 100, 1)) REQUIRE(moved.at(p).velocity == flow.at(p).velocity);
    }
}

TEST_CASE("Flow: invalid flows are errors", "[flow]") {
    CHECK_THROWS_AS(Flow(std::vector<Flow::Potentials>{}, Domain{}), ValueError);
    CHECK_THROWS_AS(FlowN<5>(std::vector<FlowN<5>::Potentials>{}, {}), ValueError);
    const Flow flow(noise(1), noise(2)), same = flow.normalized(1);
    CHECK_THROWS_WITH(flow + same, Catch::ContainsSubstring("normalised"));
    CHECK_THROWS_WITH(same + flow, Catch::ContainsSubstring("normalised"));
    CHECK_THROWS_AS(same + same, ValueError);
    CHECK_NOTHROW((flow + flow).normalized(1));
    for (const double bad : {0.0, -1.0, 1e16, std::nan(""), std::numeric_limits<double>::infinity()}) {
        CAPTURE(bad);
        CHECK_THROWS_WITH(flow.normalized(bad), Catch::ContainsSubstring("speed"));
    }
}

TEST_CASE("Flow: nothing flows through a wall", "[flow]") {
    // On the zero level, the velocity is orthogonal to ∇d except for a few roundings of a velocity of 10. On the
    // sphere, d is a rounding of 0, and α is of third order in it.
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
    // The fluxes through a closed surface other than the wall add up to zero (Gauss), within the error of a sum over
    // 20,000 points. This is the total flux through a smaller sphere.
    constexpr int kCount = 20000;
    double total = 0, squares = 0;
    for (int k = 0; k < kCount; ++k) {
        // Fibonacci points are evenly distributed, so the sum converges faster than with random points.
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

TEST_CASE("withSpeed: sets the rms speed over the domain", "[flow]") {
    for (const auto& [name, flow] : flows()) {
        CAPTURE(name);
        const Flow paced = withSpeed(flow, 2.5);
        const FlowRms before = rmsOf(flow), after = rmsOf(paced);
        CHECK(after.speed == Approx(2.5).epsilon(1e-12)); // the same samples, so only rounding differs
        CHECK(after.potentials[1] == before.potentials[1]);
        CHECK(after.potentials[0] / before.potentials[0] == Approx(2.5 / before.speed));
        CHECK(paced.domain().box.lower == flow.domain().box.lower);
        CHECK(paced.domain().wall.has_value() == flow.domain().wall.has_value());
        // Other samples of the same domain. Speeds vary by about their own size, so the tolerance is 5 / sqrt N.
        double squares = 0, count = 0;
        for (const Vec3d& p : randomPoints(flow.domain().box, 40000, 5)) {
            const auto& wall = flow.domain().wall;
            if (wall && !(beyondWall(wall->side, wall->sdf.distance.at<0>(p).value) < 0)) continue;
            const Vec3d c = paced.at(p).velocity;
            squares += dot(c, c);
            ++count;
        }
        CHECK(std::sqrt(squares / count) == Approx(2.5).epsilon(5 / std::sqrt(count) + 0.005));
        // The streamlines are the same: velocities differ by a constant factor.
        for (const Vec3d& p : randomPoints(flow.domain().box, 100, 6)) {
            const Vec3d c = flow.at(p).velocity * (2.5 / before.speed);
            CHECK(length(paced.at(p).velocity - c) <= 1e-14 * (1 + length(c)));
        }
    }
}

// As many random samples would have standard errors of about 5e-3.
constexpr double kWithin = 1e-3;

TEST_CASE("rmsOf: gives the same bits for any number of threads and matches closed forms", "[flow]") {
    const auto measured = [] { return rmsOf(boundFlow(sphereSdf(1), Side::inside)); };
    FlowRms one;
    {
        const ThreadLimit limit(1);
        one = measured();
    }
    const ThreadLimit limit(2);
    const FlowRms two = measured();
    CHECK(std::bit_cast<uint64_t>(one.speed) == std::bit_cast<uint64_t>(two.speed));
    CHECK(std::bit_cast<uint64_t>(one.potentials[0]) == std::bit_cast<uint64_t>(two.potentials[0]));
    CHECK(std::bit_cast<uint64_t>(one.potentials[1]) == std::bit_cast<uint64_t>(two.potentials[1]));
    // f = x, g = 2 y in the cube [-1, 1]: c = (0, 0, 2), and the mean of x² is 1/3.
    const FlowRms simple = rmsOf(Flow(rampField({{1, 0, 0}}), rampField({{0, 2, 0}})));
    CHECK(simple.speed == 2);
    CHECK(simple.potentials[0] * simple.potentials[0] == Approx(1.0 / 3).epsilon(kWithin));
    CHECK(simple.potentials[1] * simple.potentials[1] == Approx(4.0 / 3).epsilon(kWithin));
}

TEST_CASE("rmsOf: measures a flow and its copies once, and a changed copy again", "[flow]") {
    const Flow flow(noise(1), noise(2));
    const Monitor cancelled{.report = {}, .cancelled = [] { return true; }};
    CHECK_THROWS_AS(rmsOf(flow, cancelled), Interrupted);
    const FlowRms rms = rmsOf(flow);
    const Flow copy = flow;
    CHECK(rmsOf(copy, cancelled).speed == rms.speed);
    CHECK(rmsOf(copy, cancelled).potentials == rms.potentials);
    for (const Flow& changed : {flow.within({.box = cube(2), .wall = {}}), flow.normalized(2), flow.onLevelSets(),
                                scaled(flow, 2.0), flow + copy})
        CHECK_THROWS_AS(rmsOf(changed, cancelled), Interrupted);
    CHECK(rmsOf(scaled(flow, 2.0)).speed == Approx(2 * rms.speed));
}

TEST_CASE("rmsOf: measures each term of a sum as if it were alone", "[flow]") {
    const Flow first(noise(1), noise(2)), second(noise(3), noise(4));
    const Flow given = Flow::ofComponents({noise(5), noise(6), noise(7)}, first.domain());
    CHECK(rmsOf(first).terms.empty());
    CHECK(rmsOf(given).terms.empty());
    const Flow sum = first + second;
    for (const Flow& flow : {sum, sum + given, sum.normalized(3)}) {
        const FlowRms rms = rmsOf(flow);
        REQUIRE(rms.terms.size() == 2);
        for (const auto& [term, alone] : {std::pair(rms.terms[0], rmsOf(first)), {rms.terms[1], rmsOf(second)}}) {
            CHECK(term.speed == alone.speed);
            CHECK(term.potentials == alone.potentials);
        }
        CHECK(rms.potentials == rms.terms[0].potentials);
    }
    CHECK(rmsOf(first + scaled(first, 2.0)).speed == Approx(3 * rmsOf(first).speed).epsilon(1e-12));
    CHECK(rmsOf(sum.normalized(3)).speed == Approx(3).epsilon(1e-12));
}

TEST_CASE("rmsOf: matches closed forms in 2D and 5D", "[flow]") {
    SECTION("2D: f = x² + y² in a square and in a disc") {
        const FlowN<2> flow(FlowN<2>::Potentials{polynomial<2>("x0**2 + x1**2")});
        const auto m = rmsOf(flow);
        CHECK(m.speed * m.speed == Approx(8.0 / 3).epsilon(kWithin));
        CHECK(m.potentials[0] * m.potentials[0] == Approx(2.0 / 5 + 2.0 / 9).epsilon(kWithin));
        // In the disc of radius 1, the mean of r² is 1/2.
        const WallN<2> wall{.sdf = sphereSdf<2>(1), .side = Side::inside, .width = 0.1};
        const double inside = rmsOf(flow.within(DomainN<2>::of(wall))).speed;
        CHECK(inside * inside == Approx(2).epsilon(kWithin));
        const FlowN<2> paced = withSpeed(flow, 3);
        CHECK(rmsOf(paced).speed == Approx(3).epsilon(1e-12));
        CHECK(paced.at({{0.6, -0.3}}).velocity[0] * 2 == Approx(paced.at({{0.6, -0.3}}).velocity[1]));
    }
    SECTION("5D: ramps with the determinant as speed") {
        const auto ramp = [](int axis, double slope) { return rampField<5>(unit<5>(axis) * slope); };
        const FlowN<5> flow(FlowN<5>::Potentials{ramp(1, 2), ramp(0, 3), ramp(4, -1), ramp(2, 0.5)},
                            {.box = {{}, {{1, 2, 3, 4, 5}}}, .wall = {}});
        const auto m = rmsOf(flow);
        CHECK(m.speed == Approx(3).epsilon(1e-12));
        const std::array<double, 4> squares{4 * 4 / 3.0, 9 / 3.0, 25 / 3.0, 0.25 * 9 / 3.0};
        for (size_t k = 0; k < 4; ++k) CHECK(m.potentials[k] * m.potentials[k] == Approx(squares[k]).epsilon(kWithin));
        const FlowN<5> paced = withSpeed(flow, 0.1);
        CHECK(rmsOf(paced).speed == Approx(0.1).epsilon(1e-12));
        // det[e_4 | 2 e_2 | 3 e_1 | -e_5 | e_3 / 2]: the product 2 · 3 · -1 · 1/2 times the sign of the permutation (4,
        // 2, 1, 5, 3), which is odd.
        CHECK(length(flow.at({{1, 1, 1, 1, 1}}).velocity - unit<5>(3) * 3.0) < 1e-14);
        CHECK(length(paced.at({{1, 1, 1, 1, 1}}).velocity - unit<5>(3) * 0.1) < 1e-14);
    }
}

TEST_CASE("withSpeed: works for sums and normalised flows", "[flow]") {
    const auto check = [](const auto& flow) {
        constexpr int N = std::remove_cvref_t<decltype(flow)>::kDimension;
        const double before = rmsOf(flow).speed;
        const FlowN<N> paced = withSpeed(flow, 2.5);
        CHECK(rmsOf(paced).speed == Approx(2.5).epsilon(1e-12));
        CHECK(paced.terms().size() == flow.terms().size());
        CHECK(paced.divergenceFree() == flow.divergenceFree());
        WorstN<N> worst;
        for (const auto& p : randomPoints(flow.domain().box, 500, 1)) {
            const auto c = flow.at(p).velocity * (2.5 / before);
            worst.see(length(paced.at(p).velocity - c) / (1 + length(c)), p);
        }
        CHECK(worst.value < 1e-13);
        // Setting the present speed changes nothing.
        CHECK(withSpeed(flow, before).at({}).velocity == flow.at({}).velocity);
    };
    check(flows()[1].flow + flows()[0].flow);
    check(flows()[1].flow.normalized(4));
    check((flows()[1].flow + flows()[0].flow).normalized(0.01));
    check(planeFlows().back().flow);
    check(planeFlows()[0].flow.normalized(3));
    check(cubics<5>() + flowOf<SineNoise<5>>({}));
    CHECK(rmsOf(flows()[2].flow.normalized(4)).speed == Approx(4).epsilon(1e-12));
    CHECK(withSpeed(flows()[1].flow.normalized(4), 3).uniformSpeed() == 3);
}

TEST_CASE("rmsOf: finds a domain that is a small part of its box and refuses an empty one", "[flow]") {
    Wall wall{.sdf = sphereSdf(0.05), .side = Side::inside, .width = 0.02};
    const Flow small(noise(1), noise(2), {.box = cube(1), .wall = wall}); // 6.5e-5 of the box
    CHECK(rmsOf(small).speed > 0);
    wall.sdf = placed(wall.sdf, {.offset = {{5, 0, 0}}});
    const Flow empty(noise(1), noise(2), {.box = cube(1), .wall = wall});
    CHECK_THROWS_AS(rmsOf(empty), ValueError);
    CHECK_THROWS_AS(withSpeed(empty, 1), ValueError);
}

TEST_CASE("withSpeed: an invalid speed or a flow at rest is an error", "[flow]") {
    const Flow flow(noise(1), noise(2));
    for (const double bad : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
        CAPTURE(bad);
        CHECK_THROWS_AS(withSpeed(flow, bad), ValueError);
    }
    CHECK_THROWS_AS(withSpeed(Flow(noise(1), noise(1)), 1), ValueError); // the flow is zero
    const Monitor cancelled{.report = {}, .cancelled = [] { return true; }};
    CHECK_THROWS_AS(withSpeed(Flow(noise(1), noise(2)), 1, cancelled), Interrupted); // not measured yet
}

TEST_CASE("FlowN: components add to terms, and a flow with components is not a sum of terms", "[flow]") {
    const Flow potentials(noise(1), noise(2), {.box = cube(1), .wall = {}});
    const Flow given = Flow::ofComponents({noise(3), noise(4), noise(5)}, potentials.domain());
    CHECK_FALSE(given.hasTracks());
    CHECK_FALSE(given.divergenceFree());
    CHECK(given.terms().empty());
    const Flow sum = potentials + given;
    CHECK_FALSE(sum.hasTracks());
    CHECK_FALSE(sum.divergenceFree());
    Worst worst;
    for (const Vec3d& p : randomPoints(cube(1), 500, 1)) {
        const Vec3d components{{noise(3).at<0>(p).value, noise(4).at<0>(p).value, noise(5).at<0>(p).value}};
        worst.see(length(given.at(p).velocity - components), p);
        worst.see(length(sum.at(p).velocity - potentials.at(p).velocity - components), p);
        worst.see(length(scaled(sum, 3.0).at(p).velocity - sum.at(p).velocity * 3.0), p);
        worst.see(std::abs(given.at(p).potentials[0]), p);
    }
    CAPTURE(worst.where);
    CHECK(worst.value < 1e-12); // roundings of velocities of about 100
    requireJacobian(sum, cube(1), 200, 2);
    CHECK(rmsOf(withSpeed(sum, 2)).speed == Approx(2).epsilon(1e-12));
    CHECK(rmsOf(given.normalized(2)).speed == Approx(2).epsilon(1e-12));
    CHECK_THROWS_AS(given.normalized(1) + potentials, ValueError);
    const ScalarField zero = constantField(0);
    CHECK_THROWS_AS(withSpeed(Flow::ofComponents({zero, zero, zero}, given.domain()), 1), ValueError);
}
