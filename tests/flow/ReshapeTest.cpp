// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flows.h"
#include "curlew/flow/Reshape.h"
#include "curlew/track/Stepper.h"
#include "support/FlowChecks.h"
#include "support/Formula.h"

using namespace curlew;
using namespace curlew::test;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

ScalarField noise(uint64_t seed) { return noiseField<Psrd3>({.seed = seed}, {.frequency = 1.5}); }

const Flow& noiseFlow() {
    static const Flow flow(noise(1), noise(2));
    return flow;
}
const Flow& ballFlow() {
    static const Wall wall{.sdf = sphereSdf(1), .side = Side::inside, .width = 0.15};
    static const Flow flow(noise(1), bounded(noise(2), wall), Domain::of(wall));
    return flow;
}
const Flow& smoothFlow() {
    static const Flow flow(sinesF(), sinesG());
    return flow;
}

/// A flow of polynomials, fast to evaluate. f and g cover [-1, 1], and it moves almost everywhere.
const Flow& shearFlow() {
    static const Flow flow(formula([](const auto& x) { return x[0] * 0.75 + x[1] * x[1] * x[1] * 0.25; }),
                           formula([](const auto& x) { return x[1] * 0.75 + x[0] * x[2] * 0.25; }));
    return flow;
}

/// Random points of the domain, other than the samples of reshaped().
std::vector<Vec3d> pointsIn(const Domain& domain, size_t count, uint64_t seed) {
    std::vector<Vec3d> points;
    for (uint64_t k = 0; points.size() < count; ++k) {
        const Vec3d p = randomPoint(domain.box, seed, k);
        if (domain.wall && !(beyondWall(domain.wall->side, domain.wall->sdf.distance.at<0>(p).value) < 0)) continue;
        points.push_back(p);
    }
    return points;
}

/// Requires what holds for each reshaped flow: its velocity is h c with 0 <= h <= 1.
void requireSlower(const Flow& flow, const Flow& slow, const std::vector<Vec3d>& points) {
    CHECK(slow.hasTracks());
    CHECK(slow.divergenceFree());
    Worst across, faster, backward;
    for (const Vec3d& p : points) {
        const Vec3d c = flow.at(p).velocity, r = slow.at(p).velocity;
        const Vec3d f = slow.f().at<1>(p).gradient, g = slow.g().at<1>(p).gradient;
        // r is computed from the gradient of the new potential, whose part along ∇g cancels. This leaves roundings of
        // their sizes.
        const double rounding = 1 + length(f) * length(g) / (length(c) + 1e-300);
        across.see(length(cross(c, r)) / (dot(c, c) * rounding), p);
        faster.see((length(r) / length(c) - 1) / rounding, p);
        backward.see(-dot(c, r) / (dot(c, c) * rounding), p);
    }
    CAPTURE(across.value, across.where, faster.value, faster.where, backward.value, backward.where);
    CHECK(across.value < 1e-14);
    CHECK(faster.value < 1e-13); // a hundred coefficients are summed, and differences of them are taken
    CHECK(backward.value < 1e-13);
}

} // namespace

TEST_CASE("reshaped: keeps directions and is nowhere faster", "[flow]") {
    const auto check = [](const Flow& flow, const ReshapeOptions& o) {
        CAPTURE(o.limit, o.f.lower, o.f.upper);
        const Flow slow = reshaped(flow, o);
        const auto points = pointsIn(flow.domain(), 3000, 1);
        requireSlower(flow, slow, points);
        // The bins of the spline are a hundredth of the ranges of f and g, so the step of the differences is smaller by
        // that factor than for the original flow.
        requireDivergenceFree(slow, flow.domain().box, {.count = 10000, .still = 0.5, .differences = 1e-3});
        CHECK(slow.domain().wall.has_value() == flow.domain().wall.has_value());
        CHECK(slow.domain().box.upper == flow.domain().box.upper);
        // The second potential is unchanged.
        CHECK(slow.g().at<1>(points[0]).gradient == flow.g().at<1>(points[0]).gradient);
        // Outside the domain, which was not sampled, the direction is still the same.
        requireSlower(flow, slow, randomPoints(flow.domain().box.padded(3), 1000, 2));
    };
    check(noiseFlow(), {.limit = 3});
    check(noiseFlow(), {.f = {-0.25, 0.2}, .g = {-kInfinity, 0.1}});
    check(ballFlow(), {.limit = 1, .f = {-0.4, kInfinity}, .softness = 0});
    check(smoothFlow(), {.limit = 8});
    check(vortexFlow(1, 0.4), {.limit = 0.7, .g = {-0.5, 0.9}, .softness = 0.5});
    check(shearFlow(), {.limit = 0.5});
}

TEST_CASE("reshaped: no streamline is faster than the limit", "[flow]") {
    // The greatest speed of each streamline is estimated from 2^20 samples, some hundred in each of 96² bins, and what
    // is found by climbing from the fastest of each bin, as the largest of the surrounding 7² bins. One
    // in 50,000 points may be missed: of 300,000 one was, by 1.9 %.
    struct Case {
        const char* name;
        Flow flow;
        double limit, excess, part;
    };
    for (const auto& [name, flow, limit, excess, part] :
         {Case{"noise", noiseFlow(), 13.7, 1.05, 2e-5}, Case{"in a ball", ballFlow(), 3.6, 1.05, 2e-5},
          Case{"smooth", smoothFlow(), 1.6, 1.01, 0}, Case{"vortex", vortexFlow(1, 0.4), 0.8, 1.01, 0}}) {
        const Flow slow = reshaped(flow, {.limit = limit});
        Worst fastest, before;
        const auto points = pointsIn(flow.domain(), 50000, 3);
        size_t beyond = 0;
        double squares = 0, limited = 0;
        for (const Vec3d& p : points) {
            const double was = length(flow.at(p).velocity) / limit, is = length(slow.at(p).velocity) / limit;
            before.see(was, p);
            fastest.see(is, p);
            beyond += is > 1.01;
            squares += is * is;
            limited += std::min(1.0, was * was);
        }
        CAPTURE(name, fastest.value, fastest.where, before.value, beyond, squares, limited);
        CHECK(before.value > 1.2);
        CHECK(fastest.value < excess);
        CHECK(static_cast<double>(beyond) <= part * static_cast<double>(points.size()));
        CHECK(fastest.value > 0.8);     // the limit is nearly reached
        CHECK(squares > 0.1 * limited); // the flow is not stopped altogether
    }
}

TEST_CASE("reshaped: changes nothing where the limit is not reached", "[flow]") {
    const auto check = [](const Flow& flow, const ReshapeOptions& o) {
        const Flow same = reshaped(flow, o);
        Worst velocity, derivative;
        for (const Vec3d& p : pointsIn(flow.domain(), 3000, 4)) {
            const auto a = flow.at(p), b = same.at(p);
            const double size = length(flow.f().at<1>(p).gradient) * length(flow.g().at<1>(p).gradient);
            velocity.see(length(a.velocity - b.velocity) / size, p);
            for (int i = 0; i < 3; ++i)
                derivative.see(length(a.derivative[i] - b.derivative[i]) / (size + productsIn(flow, p)), p);
        }
        CAPTURE(o.limit, o.f.lower, o.g.lower, velocity.value, velocity.where, derivative.value, derivative.where);
        CHECK(velocity.value < 1e-12);   // sums of a hundred ones and differences of them
        CHECK(derivative.value < 1e-10); // the derivative is divided by the width of a bin
    };
    check(noiseFlow(), {.limit = 1e5});
    check(ballFlow(), {});
    check(smoothFlow(), {.f = {-100, 100}, .g = {-kInfinity, 100}});
    check(shearFlow(), {.f = {-100, kInfinity}, .g = {-1e300, 1e300}, .softness = 0.5});
}

TEST_CASE("reshaped: stops streamlines outside the intervals and keeps those inside", "[flow]") {
    struct Case {
        const Flow& flow;
        ReshapeOptions options;
    };
    // The ends of the intervals are anywhere within the bins of the spline.
    const auto [flow, o] = GENERATE(from_range(std::vector<Case>{
        {shearFlow(), {.f = {-0.531, 0.777}, .softness = 0}},
        {shearFlow(), {.f = {-0.531, 0.777}, .softness = 0.1}},
        {shearFlow(), {.f = {-0.531, 0.777}, .softness = 0.5}},
        {shearFlow(), {.g = {-0.9041, 0.3}, .softness = 0.2}},
        {shearFlow(), {.f = {-0.6, 0.601}, .g = {-0.4, kInfinity}, .softness = 0}},
        {shearFlow(), {.f = {-0.6, 0.601}, .g = {-0.4, kInfinity}, .softness = 0.15}},
        {shearFlow(), {.f = {-kInfinity, 0.35}, .softness = 0.25}},
        {noiseFlow(), {.f = {-0.5, 0.502}, .softness = 0}},
        {ballFlow(), {.g = {-0.22, -0.04}, .softness = 0.1}},
        {smoothFlow(), {.f = {-1.1, 1.8}, .g = {-1.5, kInfinity}, .softness = 0.1}},
    }));
    const Flow slow = reshaped(flow, o);
    const auto points = pointsIn(flow.domain(), 8000, 5);
    std::array<Interval, 2> all;
    all.fill({kInfinity, -kInfinity});
    for (const Vec3d& p : points) {
        const auto potentials = flow.at(p).potentials;
        for (size_t k = 0; k < 2; ++k)
            all[k] = {std::min(all[k].lower, potentials[k]), std::max(all[k].upper, potentials[k])};
    }
    // A spline deviates within 4 of its 96 bins from an end. An interval without an end is as long as the range of the
    // values.
    const auto middle = [&](const Interval& r, const Interval& values, double v) {
        const double length = std::min(r.upper, values.upper) - std::max(r.lower, values.lower);
        const double margin = 1.05 * (o.softness * length + (values.upper - values.lower) * 4 / 96);
        return v > r.lower + margin && v < r.upper - margin;
    };
    Worst moving, changed;
    size_t outer = 0, inner = 0, between = 0;
    for (const Vec3d& p : points) {
        const auto before = flow.at(p);
        const auto [f, g] = before.potentials;
        const Vec3d c = before.velocity, r = slow.at(p).velocity;
        const double size = length(c) + length(slow.f().at<1>(p).gradient) * length(slow.g().at<1>(p).gradient);
        if (!o.f.contains(f) || !o.g.contains(g)) {
            ++outer;
            moving.see(length(r) / size, p);
        } else if (middle(o.f, all[0], f) && middle(o.g, all[1], g)) {
            ++inner;
            changed.see(length(r - c) / size, p);
        } else {
            between += length(r) > 0.2 * length(c) && length(r) < 0.8 * length(c);
        }
    }
    CAPTURE(o.softness, o.f.lower, o.f.upper, o.g.lower, o.g.upper, outer, inner, between);
    CAPTURE(moving.value, moving.where, changed.value, changed.where);
    CHECK(moving.value < 1e-12); // sums of a hundred coefficients
    CHECK(changed.value < 1e-12);
    CHECK(outer > 300);
    if (o.softness < 0.5) CHECK(inner > 300);
    CHECK(between > 20);
}

TEST_CASE("reshaped: the new potential is constant along the same streamlines", "[flow]") {
    const Flow& flow = smoothFlow();
    const Flow slow = reshaped(flow, {.limit = 0.7 * rmsOf(flow).speed, .f = {-2, 2.2}});
    PointBatch from, to;
    while (!from.full()) from.push(randomPoint(cube(1), 6, static_cast<uint64_t>(from.size)));
    const PointBatch start = from;
    StagesN<3> stages;
    std::array<double, kBatch> dt;
    dt.fill(1e-3);
    const auto follow = [&](const Flow& along, PointBatch at) {
        for (int k = 0; k < 300; ++k) {
            const auto velocity = [&](const PointBatch& p, VecBatch<double>& v) { along.velocity(p, v); };
            velocity(at, stages[0]);
            step(Scheme::rk4, at, dt, velocity, stages, to);
            at = to;
        }
        return at;
    };
    const PointBatch fast = follow(flow, start), late = follow(slow, start);
    Worst drift, drift2;
    double moved = 0, behind = 0;
    for (int i = 0; i < kBatch; ++i) {
        const double before = slow.f().at<0>(start[i]).value;
        drift.see(std::abs(slow.f().at<0>(fast[i]).value - before), start[i]);
        for (size_t k = 0; k < 2; ++k)
            drift2.see(std::abs(flow.at(late[i]).potentials[k] - flow.at(start[i]).potentials[k]), start[i]);
        moved += length(fast[i] - start[i]) / kBatch;
        behind += length(late[i] - fast[i]) / kBatch;
    }
    CAPTURE(drift.value, drift.where, drift2.value, drift2.where, moved, behind);
    // RK4 with steps of at most 0.02 of a wavelength. The spline is only C², so its knots add to the error.
    CHECK(drift.value < 1e-6);
    CHECK(drift2.value < 1e-6);
    CHECK(moved > 0.3);
    CHECK(behind > 0.05);
}

TEST_CASE("reshaped: derivatives of the new potential agree with central differences", "[flow]") {
    for (const auto& [flow, options] : {std::pair{smoothFlow(), ReshapeOptions{.limit = 4, .g = {-2.5, 2.2}}},
                                        std::pair{ballFlow(), ReshapeOptions{.limit = 2}}}) {
        const Flow slow = reshaped(flow, options);
        const auto points = pointsIn(flow.domain(), 3000, 7);
        // The bins of the spline are a hundredth of the ranges of f and g: third derivatives are 10^6 times those of f
        // and g (observed: 2 10^7).
        requireDerivatives(slow.f(), points, 0x1p-13, 1e8);
        requireJacobian(slow, cube(0.5), 2000, 8, 0x1p-13);
        // Third derivatives by differences of the Hessian.
        std::vector<double> errors;
        const double h = 0x1p-14;
        for (const Vec3d& p : points) {
            const auto jet = slow.f().at<3>(p);
            double worst = 0, size = 1;
            for (int k = 0; k < 3; ++k) {
                const auto up = slow.f().at<2>(p + unit(k) * h), down = slow.f().at<2>(p - unit(k) * h);
                for (int i = 0; i < 3; ++i)
                    for (int j = i; j < 3; ++j) {
                        const double third = (up.hessian(i, j) - down.hessian(i, j)) / (2 * h);
                        worst = std::max(worst, std::abs(third - jet.third(i, j, k)));
                        size = std::max(size, std::abs(third));
                    }
            }
            errors.push_back(worst / size);
        }
        CHECK(median(errors) < 1e-5);
        // C²: with smaller steps the Hessian changes less, also across the knots of the spline.
        const auto jump = [&slow = slow](double length) {
            Worst worst;
            for (uint64_t k = 0; k < 50; ++k) {
                const Vec3d p = randomPoint(cube(0.5), 9, k), direction = randomPoint(cube(1), 10, k);
                auto last = slow.f().at<2>(p);
                for (double s = length; s < 0.01; s += length) {
                    const auto next = slow.f().at<2>(p + direction * s);
                    worst.see(difference(next, last), p + direction * s);
                    last = next;
                }
            }
            return worst.value;
        };
        const double coarse = jump(1e-4), fine = jump(1e-5);
        CAPTURE(coarse, fine);
        CHECK(fine < 0.2 * coarse);
    }
}

TEST_CASE("reshaped: float agrees with double", "[flow]") {
    const Flow slow = reshaped(noiseFlow(), {.limit = 1, .f = {-0.4, 0.5}});
    Worst worst;
    for (uint64_t batch = 0; batch < 20; ++batch) {
        PointBatch points;
        while (!points.full()) points.push(randomPoint(cube(1), batch, static_cast<uint64_t>(points.size)));
        VecBatch<float> single;
        VecBatch<double> exact;
        slow.velocity(points, single);
        slow.velocity(points, exact);
        for (int i = 0; i < kBatch; ++i)
            for (int axis = 0; axis < 3; ++axis)
                worst.see(std::abs(static_cast<double>(single[i][axis]) - exact[i][axis]), points[i]);
    }
    CAPTURE(worst.value, worst.where);
    CHECK(worst.value < 1e-5); // observed: 8e-7, the rounding of the noise itself
}

TEST_CASE("reshaped: does not depend on threads and can be cancelled", "[flow]") {
    const auto velocities = [] {
        const Flow slow = reshaped(ballFlow(), {.limit = 1});
        std::vector<Vec3d> all;
        for (const Vec3d& p : randomPoints(cube(1), 200, 11)) all.push_back(slow.at(p).velocity);
        return all;
    };
    std::vector<Vec3d> one;
    {
        const ThreadLimit limit(1);
        one = velocities();
    }
    const ThreadLimit limit(2);
    CHECK(velocities() == one);
    const Monitor cancelled{.report = {}, .cancelled = [] { return true; }};
    CHECK_THROWS_AS(reshaped(noiseFlow(), {.limit = 1}, cancelled), Interrupted);
}

TEST_CASE("reshaped: can be reshaped again and set to a speed and evaluated far outside", "[flow]") {
    const Flow once = reshaped(noiseFlow(), {.limit = 1}), twice = reshaped(once, {.limit = 0.5});
    requireSlower(once, twice, randomPoints(cube(1), 500, 12));
    CHECK(rmsOf(withSpeed(twice, 3)).speed == Approx(3).epsilon(1e-12));
    // Positions that are not finite give velocities that are not finite, and do no harm.
    for (const double bad : {std::nan(""), kInfinity, 1e300}) {
        CAPTURE(bad);
        const auto sample = twice.at({{bad, 0, 0}});
        CHECK((std::isnan(sample.velocity[1]) || std::isfinite(sample.velocity[1])));
    }
    // Potentials far outside their range in the domain.
    const Flow shear = reshaped(Flow(rampField({{1, 0, 0}}), rampField({{0, 1, 0}})), {.limit = 0.5});
    for (const double far : {-1e12, -1e5, -3.0, 3.0, 1e5, 1e12})
        CHECK(length(shear.at({{far, far, 0}}).velocity - Vec3d{{0, 0, 0.5}}) < 1e-9);
}

TEST_CASE("reshaped: unsuitable flows and options are errors", "[flow]") {
    const Flow& flow = noiseFlow();
    CHECK_THROWS_WITH(reshaped(flow + flow, {.limit = 1}), Catch::ContainsSubstring("sum"));
    CHECK_THROWS_WITH(reshaped(flow.normalized(1), {.limit = 1}), Catch::ContainsSubstring("normalised"));
    for (const double bad : {-1.0, std::nan(""), kInfinity}) {
        CAPTURE(bad);
        CHECK_THROWS_WITH(reshaped(flow, {.limit = bad}), Catch::ContainsSubstring("limit"));
    }
    for (const double bad : {-0.1, 0.51, std::nan(""), kInfinity}) {
        CAPTURE(bad);
        CHECK_THROWS_WITH(reshaped(flow, {.softness = bad}), Catch::ContainsSubstring("softness"));
    }
    for (const Interval& bad :
         {Interval{0, 0}, Interval{1, -1}, Interval{std::nan(""), 1}, Interval{0, std::nan("")}}) {
        CAPTURE(bad.lower, bad.upper);
        CHECK_THROWS_WITH(reshaped(flow, {.f = bad}), Catch::ContainsSubstring("interval"));
        CHECK_THROWS_WITH(reshaped(flow, {.g = bad}), Catch::ContainsSubstring("interval"));
    }
    // Intervals that contain no streamline, or that the spline cannot resolve.
    for (const Interval& bad : {Interval{5, 6}, Interval{0.1, 0.12}}) {
        CAPTURE(bad.lower, bad.upper);
        CHECK_THROWS_WITH(reshaped(shearFlow(), {.f = bad}), Catch::ContainsSubstring("nothing would move"));
        CHECK_THROWS_WITH(reshaped(shearFlow(), {.g = bad}), Catch::ContainsSubstring("nothing would move"));
    }
    CHECK_NOTHROW(reshaped(shearFlow(), {.f = {0.1, 0.25}}));
    CHECK_THROWS_WITH(reshaped(flow.within({.box = cube(kInfinity), .wall = {}}), {.limit = 1}),
                      Catch::ContainsSubstring("infinite"));
    CHECK_THROWS_WITH(reshaped(Flow(noise(1), constantField(1)), {.limit = 1}), Catch::ContainsSubstring("constant"));
    const Wall wall{.sdf = placed(sphereSdf(0.1), {.offset = {{5, 0, 0}}}), .side = Side::inside, .width = 0.1};
    CHECK_THROWS_WITH(reshaped(flow.within({.box = cube(1), .wall = wall}), {.limit = 1}),
                      Catch::ContainsSubstring("empty"));
}
