// SPDX-License-Identifier: Apache-2.0
// Longer than 400 lines: each shape has its own exact distances.
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/ShapeModels.h"
#include "curlew/field/Shapes.h"
#include "support/FiniteDifference.h"
#include "support/Samples.h"

#include <functional>
#include <limits>

using namespace curlew;
using namespace curlew::test;

namespace {

struct Shape {
    std::string name;
    Sdf sdf;
    std::function<bool(const Vec3d&)> inside;
    /// Returns the distance from the nearest kink or seam, where the shape's distance is not C^inf. Finite differences
    /// stay away from these.
    std::function<double(const Vec3d&)> clearance;
};

double square(double x) { return x * x; }

/// Returns the clearance of a shape whose formula switches where one of these values is zero.
double least(std::initializer_list<double> values) {
    double l = 1e300;
    for (const double v : values) l = std::min(l, std::abs(v));
    return l;
}

std::vector<Shape> allShapes() {
    const Vec3d half{{0.5, 0.4, 0.7}};
    const double rounding = 0.1;
    const Vec3d inner = half - Vec3d{{rounding, rounding, rounding}};
    const auto boxInside = [=](const Vec3d& p) {
        double squares = 0;
        for (int i = 0; i < 3; ++i) squares += square(std::max(std::abs(p[i]) - inner[i], 0.0));
        return squares < rounding * rounding;
    };
    const auto boxClearance = [=](const Vec3d& p) {
        const Vec3d q{{std::abs(p[0]) - inner[0], std::abs(p[1]) - inner[1], std::abs(p[2]) - inner[2]}};
        return least({p[0], p[1], p[2], q[0], q[1], q[2], q[0] - q[1], q[1] - q[2], q[0] - q[2]});
    };
    const auto cylinder = [](const Vec3d& p) { return std::hypot(p[0], p[2]); };
    return {
        {"sphere", sphereSdf(0.8), [](const Vec3d& p) { return dot(p, p) < 0.64; },
         [](const Vec3d& p) { return length(p); }},
        {"box", boxSdf(half * 2.0, rounding), boxInside, boxClearance},
        {"torus", torusSdf(0.6, 0.25),
         [=](const Vec3d& p) { return square(cylinder(p) - 0.6) + square(p[1]) < 0.0625; },
         [=](const Vec3d& p) { return std::min(cylinder(p), std::hypot(cylinder(p) - 0.6, p[1])); }},
        {"capsule", capsuleSdf(0.8, 0.3),
         [=](const Vec3d& p) { return square(cylinder(p)) + square(std::max(std::abs(p[1]) - 0.4, 0.0)) < 0.09; },
         [=](const Vec3d& p) { return std::min(cylinder(p), least({std::abs(p[1]) - 0.4})); }},
        {"cylinder", sdfOf(shapes::Cylinder{1.2, 0.5, 0.1}),
         [=](const Vec3d& p) {
             const double side = std::max(cylinder(p) - 0.4, 0.0), cap = std::max(std::abs(p[1]) - 0.5, 0.0);
             return square(side) + square(cap) < 0.01;
         },
         [=](const Vec3d& p) {
             const double side = cylinder(p) - 0.4, cap = std::abs(p[1]) - 0.5;
             return least({cylinder(p), p[1], side, cap, side - cap});
         }},
        {"plane", planeSdf({{1, -2, 2}}, 0.6), [](const Vec3d& p) { return p[0] - 2 * p[1] + 2 * p[2] < 0.6; },
         [](const Vec3d&) { return 1.0; }},
    };
}

double distanceAt(const Sdf& sdf, const Vec3d& p) { return sdf.distance.at<0>(p).value; }

} // namespace

TEST_CASE("shapes: signed distances match exact geometry", "[field]") {
    struct Oracle {
        Sdf sdf;
        Vec3d p;
        double d;
    };
    const double rounded = std::sqrt(3.0);
    const std::vector<Oracle> oracles{
        {sphereSdf(2), {{0, 0, 0}}, -2},
        {sphereSdf(2), {{3, 4, 0}}, 3},
        {sphereSdf(2), {{0, -2, 0}}, 0},
        {boxSdf({{2, 4, 6}}, 0), {{0, 0, 0}}, -1},
        {boxSdf({{2, 4, 6}}, 0), {{0, -3, 0}}, 1},
        {boxSdf({{2, 4, 6}}, 0), {{4, 6, 3}}, 5},                     // an edge: (3, 4)
        {boxSdf({{2, 4, 6}}, 0), {{-2, 3, -4}}, rounded},             // a corner: (1, 1, 1)
        {boxSdf({{2, 4, 6}}, 0.5), {{0, 0, 2.75}}, -0.25},            // a face
        {boxSdf({{2, 4, 6}}, 0.5), {{1.5, 2.5, 3.5}}, rounded - 0.5}, // a rounded corner
        {boxSdf({{2, 2, 2}}, 1), {{3, 4, 0}}, 4},                     // fully rounded: a sphere
        {torusSdf(2, 0.5), {{0, 0, 0}}, 1.5},
        {torusSdf(2, 0.5), {{0, 0.25, -2}}, -0.25},
        {torusSdf(2, 0.5), {{5, 4, 0}}, 4.5},
        {capsuleSdf(2, 0.5), {{0, 0, 3}}, 2.5},
        {capsuleSdf(2, 0.5), {{3, 5, 0}}, 4.5},
        {capsuleSdf(2, 0.5), {{0, -1.25, 0}}, -0.25},
        {sdfOf(shapes::Cylinder{2, 1, 0}), {{0, 0, 0}}, -1},
        {sdfOf(shapes::Cylinder{2, 1, 0}), {{0, 0, 4}}, 3},
        {sdfOf(shapes::Cylinder{2, 1, 0}), {{4, 5, 0}}, 5},                              // an edge: (3, 4)
        {sdfOf(shapes::Cylinder{2, 1, 0.25}), {{0, -0.75, 0}}, -0.25},                   // a cap
        {sdfOf(shapes::Cylinder{2, 1, 0.25}), {{1.75, 1.75, 0}}, std::sqrt(2.0) - 0.25}, // a rounded edge
        {planeSdf({{0, 3, 0}}, 6), {{7, 5, 9}}, 3},
        {planeSdf({{0, 3, 0}}, 6), {{7, -1, 9}}, -3},
        {gyroidSdf(1, 0.2), {{0, 0, 0}}, -0.1}, // the middle of the sheet
    };
    for (const auto& [sdf, p, d] : oracles) {
        CAPTURE(p);
        CHECK(distanceAt(sdf, p) == Approx(d).margin(1e-15));
    }
}

TEST_CASE("shapes: distances are negative inside and bounds contain the shape", "[field]") {
    for (const Shape& shape : allShapes()) {
        size_t inside = 0;
        for (const Vec3d& p : randomPoints(cube(1), 20000, 1)) {
            const bool in = shape.inside(p);
            inside += in;
            CAPTURE(shape.name, p);
            if ((distanceAt(shape.sdf, p) < 0) != in) FAIL("wrong sign");
            if (in && !shape.sdf.bounds.contains(p)) FAIL("bounds too small");
        }
        CHECK(inside > 500);
        if (shape.name == "plane")
            CHECK_FALSE(shape.sdf.bounds.finite());
        else // tight: the bounds touch the shape
            for (int axis = 0; axis < 3; ++axis) {
                CAPTURE(shape.name, axis);
                double nearest = 1;
                for (Vec3d p : randomPoints(shape.sdf.bounds, 20000, 2)) {
                    p[axis] = shape.sdf.bounds.upper[axis];
                    nearest = std::min(nearest, std::abs(distanceAt(shape.sdf, p)));
                }
                CHECK(nearest < 0.01); // 20,000 points on a face of area 1 have a spacing of 0.007
            }
    }
    CHECK_FALSE(gyroidSdf(1, 0.1).bounds.finite());
}

TEST_CASE("shapes: distances have unit gradients that lead to the surface", "[field]") {
    for (const Shape& shape : allShapes()) {
        size_t seen = 0;
        for (const Vec3d& p : randomPoints(cube(1.5), 5000, 3)) {
            if (shape.clearance(p) < 1e-3) continue;
            ++seen;
            const auto d = shape.sdf.distance.at<1>(p);
            const Vec3d foot = p - d.gradient * d.value;
            CAPTURE(shape.name, p, d.value);
            // Rounding of numbers below 3. Near a kink it is divided by the distance to the kink.
            if (!(std::abs(length(d.gradient) - 1) < 1e-12)) FAIL("|∇d| = " << length(d.gradient));
            if (!(std::abs(distanceAt(shape.sdf, foot)) < 1e-12))
                FAIL("the foot is at " << distanceAt(shape.sdf, foot));
        }
        CHECK(seen > 4000);
    }
}

TEST_CASE("shapes: the Lipschitz bound of every distance is one", "[field]") {
    auto all = allShapes();
    all.push_back({"gyroid", gyroidSdf(0.9, 0.15), {}, {}});
    all.push_back({"sharp box", boxSdf({{1, 0.5, 0.7}}, 0), {}, {}});
    for (const Shape& shape : all)
        for (uint64_t k = 0; k < samples(20000); ++k) {
            const Vec3d p = randomPoint(cube(1.5), 4, k);
            // Both distant and near pairs; the latter detect a gradient that is too long.
            const Vec3d q = k % 2 ? randomPoint(cube(1.5), 5, k) : p + randomPoint(cube(0.01), 6, k);
            CAPTURE(shape.name, p, q);
            const double change = std::abs(distanceAt(shape.sdf, p) - distanceAt(shape.sdf, q));
            if (!(change <= length(p - q) + 1e-15)) FAIL(change << " over " << length(p - q));
        }
}

TEST_CASE("gyroidSdf: the gradient comes up to one and the sheet is centred on zero", "[field]") {
    const Sdf gyroid = gyroidSdf(1, 0.2);
    Worst steepest, sheet;
    for (const Vec3d& p : randomPoints(cube(1), samples(100000), 7)) {
        const auto d = gyroid.distance.at<1>(p);
        steepest.see(length(d.gradient), p);
        sheet.see(-d.value, p);
    }
    CAPTURE(steepest.value, steepest.where);
    CHECK(steepest.value <= 1 + 1e-15);
    CHECK(steepest.value > 0.98);
    CHECK(sheet.value <= 0.1);
    // It is not a distance.
    CHECK(gyroid.reach == 0);
    // It is periodic with its wavelength, and a cyclic permutation of the axes does not change it.
    for (const Vec3d& p : randomPoints(cube(1), 100, 8)) {
        CAPTURE(p);
        CHECK(std::abs(distanceAt(gyroid, p) - distanceAt(gyroid, p + Vec3d{{1, -2, 3}})) < 1e-14);
        CHECK(std::abs(distanceAt(gyroid, p) - distanceAt(gyroid, {{p[1], p[2], p[0]}})) < 1e-15);
    }
}

TEST_CASE("shapes: derivatives agree with central differences", "[field]") {
    for (const Shape& shape : allShapes()) {
        if (shape.name == "plane") continue; // linear: central differences are exact, below
        // At a clearance of 0.2, curvatures are at most 5 and third derivatives at most about 3 · 5². The rounded edges
        // of the box have a corner curvature of 1/q, with q >= the clearance.
        std::vector<Vec3d> points;
        for (const Vec3d& p : randomPoints(cube(1.5), 4000, 9)) {
            const double d = distanceAt(shape.sdf, p);
            const bool flat = shape.name == "box" && shape.sdf.distance.at<1>(p).gradient[0] *
                                                             shape.sdf.distance.at<1>(p).gradient[1] *
                                                             shape.sdf.distance.at<1>(p).gradient[2] ==
                                                         0;
            if (shape.clearance(p) > 0.05 && d > -0.2 && !flat) points.push_back(p);
        }
        CAPTURE(shape.name, points.size());
        REQUIRE(points.size() > 100);
        requireDerivatives(shape.sdf.distance, points, 1e-3, 3 / square(0.05));
    }
    const Sdf plane = planeSdf({{1, -2, 2}}, 0.6), gyroid = gyroidSdf(2, 0.1);
    const auto errors = derivativeErrors(plane.distance, randomPoints(cube(1), 100, 10), 1e-2);
    CHECK(errors.worstGradient() < 1e-13); // rounding of 1 divided by 1e-2
    CHECK(errors.worstHessian() == 0);
    std::vector<Vec3d> offSheet;
    for (const Vec3d& p : randomPoints(cube(1), 2000, 11))
        if (distanceAt(gyroid, p) > -0.04) offSheet.push_back(p);
    // With k = pi, third derivatives are at most 6 k³ / (sqrt 3 k).
    requireDerivatives(gyroid.distance, offSheet, 1e-3, 6 * 9.9 / 1.7);
}

TEST_CASE("boxSdf: the gradient has unit length where faces and roundings meet", "[field]") {
    // Points whose coordinates are exactly those of the inner box, as is common for voxel centres.
    const Sdf rounded = boxSdf({{2, 2, 2}}, 0.25), sharp = boxSdf({{2, 2, 2}}, 0);
    for (int axis = 0; axis < 3; ++axis)
        for (const double sign : {-1.0, 1.0}) {
            CAPTURE(axis, sign);
            const Vec3d n = unit(axis) * sign;
            const auto seam = rounded.distance.at<2>(n * 0.75);
            const auto face = sharp.distance.at<1>(n);
            CHECK(seam.value == -0.25);
            CHECK(seam.gradient == n);
            for (const double h : seam.hessian.c) CHECK(h == 0);
            CHECK(face.value == 0);
            CHECK(face.gradient == n);
        }
}

TEST_CASE("shapes: value is exact and derivatives finite where no gradient exists", "[field]") {
    const auto check = [](const Sdf& sdf, const Vec3d& p, double d) {
        const auto jet = sdf.distance.at<2>(p);
        CAPTURE(p);
        CHECK(jet.value == Approx(d));
        for (int k = 0; k < 10; ++k) CHECK(std::isfinite(jet.component(k)));
    };
    check(sphereSdf(0.5), {{0, 0, 0}}, -0.5);
    check(boxSdf({{1, 1, 1}}, 0.1), {{0, 0, 0}}, -0.5);
    check(torusSdf(0.5, 0.2), {{0, 0, 0}}, 0.3);
    check(torusSdf(0.5, 0.2), {{0.5, 0, 0}}, -0.2);
    check(capsuleSdf(1, 0.2), {{0, 0.3, 0}}, -0.2);
    check(sdfOf(shapes::Cylinder{2, 0.3, 0.1}), {{0, 0.2, 0}}, -0.3);
    check(gyroidSdf(1, 0.2), {{0, 0, 0}}, -0.1);
}

TEST_CASE("shapes: the distance of a NaN position is NaN", "[field]") {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    std::vector<Shape> shapes = allShapes();
    shapes.push_back({"gyroid", gyroidSdf(1, 0.2), {}, {}});
    for (const Shape& shape : shapes)
        for (const Vec3d& start : {Vec3d{{0.05, 0.1, -0.02}}, Vec3d{{3, 4, -2}}})
            for (int axis = 0; axis < 3; ++axis) {
                Vec3d p = start;
                p[axis] = nan;
                CAPTURE(shape.name, axis);
                CHECK(std::isnan(shape.sdf.distance.at<0>(p).value));
                PointBatch points; // the kernels on lanes
                for (int k = 0; k < kBatch; ++k) points.push(k == 3 ? p : start);
                JetBatch<double, 0> doubles;
                JetBatch<float, 1> floats;
                shape.sdf.distance.eval(points, doubles);
                shape.sdf.distance.eval(points, floats);
                CHECK(std::isnan(doubles[3].value));
                CHECK(std::isnan(floats[3].value));
                CHECK(doubles[4].value == distanceAt(shape.sdf, start));
            }
}

TEST_CASE("placed: a placed shape is moved and rotated and scaled", "[field]") {
    const Placement placement =
        GENERATE(Placement{.offset = {{1, -2, 3}}}, Placement{.scale = {{2, 2, 2}}},
                 Placement{.offset = {{0.3, 0.1, -0.5}}, .rotate = {{30, 50, -70}}, .scale = {{0.7, 0.7, 0.7}}});
    const double scale = placement.scale[0];
    for (const Shape& shape : allShapes()) {
        const Sdf moved = placed(shape.sdf, placement);
        const ScalarField expected = placed(shape.sdf.distance, placement);
        for (const Vec3d& q : randomPoints(cube(1), 2000, 12)) {
            const Vec3d p = q * (2 * scale) + placement.offset;
            CAPTURE(shape.name, p);
            const auto d = moved.distance.at<1>(p);
            if (!(std::abs(d.value - scale * expected.at<0>(p).value) < 1e-14)) FAIL("not scaled");
            if (d.value < 0 && !moved.bounds.contains(p)) FAIL("bounds too small");
            // It remains a distance.
            if (length(d.gradient) > 1 + 1e-12) FAIL("steeper than one");
        }
    }
    CHECK(placed(Sdf{sphereSdf(1).distance, sphereSdf(1).bounds, 0.25}, placement).reach == Approx(0.25 * scale));
    // A case by hand: a sphere of radius 1, scaled by 2, around (5, 0, 0).
    const Sdf sphere = placed(sphereSdf(1), {.offset = {{5, 0, 0}}, .rotate = {}, .scale = {{2, 2, 2}}});
    CHECK(distanceAt(sphere, {{5, 0, 0}}) == -2);
    CHECK(distanceAt(sphere, {{5, 3, 0}}) == 1);
    CHECK(sphere.bounds.lower == Vec3d{{3, -2, -2}});
    CHECK(sphere.bounds.upper == Vec3d{{7, 2, 2}});
}

TEST_CASE("shapes: invalid sizes are errors", "[field]") {
    for (const double bad : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
        CAPTURE(bad);
        CHECK_THROWS_AS(sphereSdf(bad), ValueError);
        CHECK_THROWS_AS(boxSdf({{1, bad, 1}}, 0), ValueError);
        CHECK_THROWS_AS(torusSdf(bad, 0.1), ValueError);
        CHECK_THROWS_AS(torusSdf(1, bad), ValueError);
        CHECK_THROWS_AS(capsuleSdf(bad, 1), ValueError);
        CHECK_THROWS_AS(capsuleSdf(1, bad), ValueError);
        CHECK_THROWS_AS(sdfOf(shapes::Cylinder{bad, 1, 0}), ValueError);
        CHECK_THROWS_AS(sdfOf(shapes::Cylinder{1, bad, 0}), ValueError);
        CHECK_THROWS_AS(gyroidSdf(bad, 0.1), ValueError);
        CHECK_THROWS_AS(gyroidSdf(1, bad), ValueError);
    }
    CHECK_THROWS_WITH(sphereSdf(-3), Catch::ContainsSubstring("-3"));
    CHECK_THROWS_AS(boxSdf({{1, 2, 3}}, -0.1), ValueError);
    CHECK_THROWS_AS(boxSdf({{1, 2, 3}}, 0.51), ValueError);
    CHECK_THROWS_AS(boxSdf({{1, 2, 3}}, std::nan("")), ValueError);
    CHECK_NOTHROW(boxSdf({{1, 2, 3}}, 0.5));
    CHECK_THROWS_AS(sdfOf(shapes::Cylinder{2, 0.5, -0.1}), ValueError);
    CHECK_THROWS_AS(sdfOf(shapes::Cylinder{2, 0.5, 0.51}), ValueError);
    CHECK_NOTHROW(sdfOf(shapes::Cylinder{1, 0.5, 0.5})); // a sphere
    CHECK_THROWS_AS(torusSdf(1, 1), ValueError);
    CHECK_THROWS_AS(planeSdf({{0, 0, 0}}, 1), ValueError);
    CHECK_THROWS_AS(placed(sphereSdf(1), {.scale = {{1, 2, 1}}}), ValueError);
    CHECK_THROWS_AS(placed(sphereSdf(1), {.scale = {{-1, -1, -1}}}), ValueError);
    CHECK_THROWS_AS(placed(sphereSdf(1), {.scale = {{0, 0, 0}}}), ValueError);
}

TEMPLATE_TEST_CASE_SIG("sphereSdf: value and derivatives are exact in every dimension", "[field]", ((int N), N), 1, 2,
                       4, 7) {
    const SdfN<N> ball = sphereSdf<N>(0.8);
    size_t inside = 0;
    for (const auto& p : randomPoints(cube<N>(1), 1000, 20)) {
        const auto d = ball.distance.template at<2>(p);
        inside += d.value < 0;
        CAPTURE(N, p);
        REQUIRE(std::abs(d.value - (length(p) - 0.8)) <= 4 * 0x1p-53);
        REQUIRE(std::abs(length(d.gradient) - 1) <= 1e-14);
        REQUIRE(length(d.gradient * length(p) - p) <= 1e-14);
        REQUIRE((d.value >= 0 || ball.bounds.contains(p)));
        double laplacian = 0;
        for (int i = 0; i < N; ++i) laplacian += d.hessian(i, i);
        REQUIRE(std::abs(laplacian * length(p) - (N - 1)) <= 1e-13); // the sum of its curvatures
    }
    CHECK((N == 7 || inside > 100));
    CHECK(ball.bounds.lower == -ball.bounds.upper);
    CHECK(ball.bounds.upper[N - 1] == 0.8);
    CHECK(std::isinf(ball.reach));
    const auto centre = ball.distance.template at<2>({});
    CHECK(centre.value == -0.8);
    for (int k = 1; k < centre.kSize; ++k) CHECK(centre.component(k) == 0);
    CHECK_THROWS_AS(sphereSdf<N>(0), ValueError);
    CHECK_THROWS_AS(sphereSdf<N>(std::nan("")), ValueError);
    if constexpr (N > 1) { // in 1D the distance is linear
        std::vector<Vec<double, N>> points = randomPoints(cube<N>(2), 400, 21);
        std::erase_if(points, [](const auto& p) { return length(p) < 0.5; });
        REQUIRE(points.size() > 100);
        requireDerivatives(ball.distance, points, 0x1p-9, 3 / square(0.5)); // third derivatives are at most 3 / |x|²
        requireThirdDerivatives(ball.distance, points, 0x1p-9);
    }
}

namespace {

/// Two overlapping shapes whose distances are smooth where their surfaces intersect.
struct Pair {
    const char* name;
    Sdf a, b;
};

std::vector<Pair> pairs() {
    return {{"balls", sphereSdf(0.6), placed(sphereSdf(0.5), {.offset = {{0.5, 0.2, -0.1}}})},
            {"ball and torus", placed(sphereSdf(0.5), {.offset = {{0.6, 0, 0}}}), torusSdf(0.6, 0.2)},
            {"box and capsule", boxSdf({{0.9, 0.7, 0.8}}, 0.1),
             placed(capsuleSdf(1.2, 0.2), {.offset = {{0.2, 0.1, 0.1}}, .rotate = {{40, 0, 70}}})},
            {"ball and plane", sphereSdf(0.7), planeSdf({{1, 2, -1}}, 0.2)}};
}

enum class Boolean { unite, intersect, subtract };

Sdf combined(Boolean how, const Sdf& a, const Sdf& b, double smoothing) {
    return how == Boolean::unite       ? unite(a, b, smoothing)
           : how == Boolean::intersect ? intersect(a, b, smoothing)
                                       : subtract(a, b, smoothing);
}

/// Returns whether a point is inside the combined shape without smoothing.
bool isIn(Boolean how, bool inA, bool inB) {
    return how == Boolean::unite ? inA || inB : how == Boolean::intersect ? inA && inB : inA && !inB;
}

/// Returns points on the zero set, found on segments between random points.
std::vector<Vec3d> surfacePoints(const Sdf& sdf, double half, uint64_t seed) {
    std::vector<Vec3d> surface;
    for (uint64_t k = 0; k < 2500; ++k) {
        Vec3d p = randomPoint(cube(half), seed, 2 * k), q = randomPoint(cube(half), seed, 2 * k + 1);
        if ((distanceAt(sdf, p) < 0) == (distanceAt(sdf, q) < 0)) continue;
        for (int halving = 0; halving < 50; ++halving) {
            const Vec3d middle = (p + q) * 0.5;
            ((distanceAt(sdf, middle) < 0) == (distanceAt(sdf, p) < 0) ? p : q) = middle;
        }
        surface.push_back(p);
    }
    return surface;
}

} // namespace

TEST_CASE("unite and intersect and subtract: the sign is that of set operations", "[field]") {
    const Boolean how = GENERATE(Boolean::unite, Boolean::intersect, Boolean::subtract);
    const double smoothing = GENERATE(0.0, 0.05, 0.3);
    for (const Pair& pair : pairs()) {
        const Sdf sdf = combined(how, pair.a, pair.b, smoothing);
        size_t inside = 0;
        for (const Vec3d& p : randomPoints(cube(1.3), 4000, 22)) {
            const double a = distanceAt(pair.a, p), b = distanceAt(pair.b, p), d = distanceAt(sdf, p);
            const bool in = isIn(how, a < 0, b < 0);
            const double other = how == Boolean::subtract ? -b : b;
            const double sharp = how == Boolean::unite ? std::min(a, b) : std::max(a, other);
            CAPTURE(static_cast<int>(how), smoothing, pair.name, p, a, b, d);
            inside += d < 0;
            if (std::abs(a - other) >= smoothing) { // away from the intersection of the surfaces
                if (d != sharp || (d < 0) != in) FAIL("not the sharp one");
            } else if (how == Boolean::unite) { // the edge is filled
                if (!(d <= sharp && d >= sharp - smoothing / 6 - 1e-15)) FAIL("not rounded outwards");
            } else { // the edge is cut off
                if (!(d >= sharp && d <= sharp + smoothing / 6 + 1e-15)) FAIL("not rounded inwards");
            }
            if (d < 0 && !sdf.bounds.contains(p)) FAIL("bounds too small");
        }
        CAPTURE(static_cast<int>(how), smoothing, pair.name);
        CHECK(inside > 10);
        CHECK(sdf.reach == 0);
        const bool endless = how == Boolean::unite && !pair.b.bounds.finite();
        CHECK(sdf.bounds.finite() == !endless);
    }
}

TEST_CASE("unite and intersect and subtract: distances are lower bounds", "[field]") {
    const Boolean how = GENERATE(Boolean::unite, Boolean::intersect, Boolean::subtract);
    const double smoothing = GENERATE(0.0, 0.3);
    for (const Pair& pair : pairs()) {
        const Sdf sdf = combined(how, pair.a, pair.b, smoothing);
        const auto surface = surfacePoints(sdf, 1, 23);
        CAPTURE(static_cast<int>(how), smoothing, pair.name);
        REQUIRE(surface.size() > 20);
        double most = -1, steepest = 0;
        for (const Vec3d& p : randomPoints(cube(1.3), 500, 24)) {
            const auto d = sdf.distance.at<1>(p);
            double nearest = 1e300;
            for (const Vec3d& q : surface) nearest = std::min(nearest, length(p - q));
            most = std::max(most, std::abs(d.value) - nearest);
            steepest = std::max(steepest, length(d.gradient));
        }
        CHECK(most <= 1e-12); // for the bisection and roundings
        CHECK(steepest <= 1 + 1e-12);
    }
    // Outside, the distance to two separate shapes is exact.
    const Sdf two = unite(sphereSdf(0.5), placed(sphereSdf(0.25), {.offset = {{2, 0, 0}}}), 0);
    CHECK(distanceAt(two, {{0, 1.5, 0}}) == 1);
    CHECK(distanceAt(two, {{2, 0, 1.25}}) == 1);
    // With smoothing, a case by hand: at equal distance from both balls, the value is lower by a sixth of the
    // smoothing.
    const Sdf twins = unite(sphereSdf(0.5), placed(sphereSdf(0.5), {.offset = {{2, 0, 0}}}), 0.3);
    CHECK(std::abs(distanceAt(twins, {{1, 0, 0}}) - (0.5 - 0.05)) <= 1e-15);
}

TEST_CASE("unite and intersect and subtract: smoothed edges are C²", "[field]") {
    const Sdf a = sphereSdf(0.6), b = placed(sphereSdf(0.5), {.offset = {{0.5, 0.2, -0.1}}});
    constexpr double kStep = 0x1p-30, k = 0.2;
    // Excludes the neighbourhoods of the centres, where a distance has a kink: curvatures are at most 1 / 0.25.
    const auto clear = [](const Vec3d& p) { return length(p) > 0.25 && length(p - Vec3d{{0.5, 0.2, -0.1}}) > 0.25; };
    const Box around{{{-0.1, 0.25, -0.8}}, {{0.7, 1, 0.8}}};
    for (const Boolean how : {Boolean::unite, Boolean::intersect, Boolean::subtract}) {
        const Sdf sdf = combined(how, a, b, k);
        const ScalarField gap = how == Boolean::subtract ? a.distance + b.distance : a.distance - b.distance;
        for (const double seam : {-k, 0.0, k}) {
            const auto jumps = jumpsAcross(sdf.distance, gap - constantField(seam), around, kStep, 25);
            CAPTURE(static_cast<int>(how), seam, jumps.seen);
            CHECK(jumps.seen > 10);
            // The gap has derivatives of at most 2, 8 and 96, the cubic of 1, 1/k and 1/k².
            CHECK(jumps.largest[0] <= 2 * kStep * 1 + 1e-15);
            CHECK(jumps.largest[1] <= 2 * kStep * (4 + 4 / k) + 1e-14);
            CHECK(jumps.largest[2] <= 2 * kStep * (3 / square(0.25) + 96 + 3 * 2 * 8 / k + 8 / (k * k)) + 1e-13);
        }
        std::vector<Vec3d> points;
        for (const Vec3d& p : randomPoints(cube(1), 1000, 26))
            if (clear(p)) points.push_back(p);
        REQUIRE(points.size() > 500);
        requireDerivatives(sdf.distance, points, 0x1p-9, 3 / square(0.24) + 96 + 3 * 2 * 8 / k + 8 / (k * k));
    }
}

TEST_CASE("unite and intersect and subtract: combined shapes can be placed and combined again", "[field]") {
    const Sdf lens = intersect(sphereSdf(0.7), placed(sphereSdf(0.7), {.offset = {{0.5, 0, 0}}}), 0);
    const Sdf bored = subtract(boxSdf({{1, 1, 1}}, 0.05), capsuleSdf(3, 0.2), 0.1);
    const Sdf all = unite(placed(lens, {.offset = {{0.4, 0.5, 0}}, .rotate = {{10, 70, 30}}}), bored, 0.4);
    size_t inside = 0;
    for (const Vec3d& p : randomPoints(cube(2), 20000, 27)) {
        const auto d = all.distance.at<1>(p);
        CAPTURE(p, d.value);
        if (d.value < 0 && !all.bounds.contains(p)) FAIL("bounds too small");
        if (length(d.gradient) > 1 + 1e-12) FAIL("steeper than one");
        inside += d.value < 0;
    }
    CHECK(inside > 100);
    CHECK(all.bounds.finite());
    CHECK(all.reach == 0);
    // The intersection of two separate shapes is empty.
    const Sdf nothing = intersect(sphereSdf(0.4), placed(sphereSdf(0.4), {.offset = {{1, 0, 0}}}), 0.1);
    for (const Vec3d& p : randomPoints(cube(2), 2000, 28)) {
        CAPTURE(p);
        if (distanceAt(nothing, p) < 0) FAIL("something");
        if (nothing.bounds.contains(p)) FAIL("its bounds should be empty");
    }
    // The union of the empty shape and a ball is the ball.
    const Sdf ball = unite(nothing, placed(sphereSdf(0.4), {.offset = {{-2, 0, 0}}}), 0);
    CHECK(distanceAt(ball, {{-2, 0, 0}}) == -0.4);
    CHECK(ball.bounds.contains({{-2.3, 0, 0}}));
}

TEST_CASE("unite and intersect and subtract: an invalid smoothing is an error", "[field]") {
    const Sdf a = sphereSdf(1), b = boxSdf({{1, 1, 1}}, 0);
    for (const double bad : {-0.1, std::nan(""), std::numeric_limits<double>::infinity()}) {
        CAPTURE(bad);
        CHECK_THROWS_AS(unite(a, b, bad), ValueError);
        CHECK_THROWS_AS(intersect(a, b, bad), ValueError);
        CHECK_THROWS_AS(subtract(a, b, bad), ValueError);
    }
}
