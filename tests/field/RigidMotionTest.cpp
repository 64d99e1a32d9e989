// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/RigidMotion.h"
#include "curlew/math/Rotation.h"
#include "support/Points.h"

#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

/// A body that circles about the z axis through (1, 0, 0) and rotates about its own axis, both at constant speed.
Pose roundabout(double t) {
    const Matrix3 turn = rotationBy({{0, 0, t}});
    return {turn * rotationBy({{0.3, -0.2, 0.5}}), turn * Vec3d{{1, 0, 0}}};
}

/// A motion with varying rotation and velocity.
Pose tumbling(double t) {
    return {rotationBy({{t + 0.2 * t * t, 0.5 * std::sin(t), -0.4 * t}}), {{std::sin(2 * t), t * t, std::cos(t)}}};
}

PoseKeys keysOf(Pose (*at)(double), double from, double step) {
    return {.before = at(from - step), .from = at(from), .to = at(from + step), .after = at(from + 2 * step)};
}

double apart(const Pose& a, const Pose& b) {
    return length(a.origin - b.origin) + length(rotationVector(a.axes * transpose(b.axes)));
}

} // namespace

TEST_CASE("rotationBy and rotationVector: are inverse exponential and logarithm", "[field]") {
    for (uint64_t k = 0; k < 300; ++k) {
        Vec3d w = randomPoint(cube(1), 4, k);
        w *= std::numbers::pi * (k % 3 == 0 ? 1e-9 : k % 3 == 1 ? 0.3 : 0.999) / length(w);
        CHECK(length(rotationVector(rotationBy(w)) - w) < 1e-9 * length(w) + 1e-16);
        CHECK(length(rotationBy(w) * w - w) < 2e-15 * length(w)); // a few roundings of three products and their sum
    }
    CHECK(rotationVector(Matrix3{}) == Vec3d{});
    const Vec3d half{{0, std::numbers::pi, 0}};
    CHECK(std::abs(std::abs(rotationVector(rotationBy(half))[1]) - std::numbers::pi) < 1e-7);
}

TEST_CASE("inPose: distance and bounds move with the body", "[field]") {
    const Sdf box = boxSdf({{1.2, 0.8, 0.6}}, 0.25);
    const Pose home{.axes = {}, .origin = {{0.1, 0.2, 0}}}, now = tumbling(0.7);
    const Sdf moved = inPose(box, home, now);
    CHECK(moved.pose.origin == now.origin);
    for (const Vec3d& p : randomPoints(cube(1), 200, 2)) {
        const Vec3d there = now.axes * (p - home.origin) + now.origin;
        CHECK(std::abs(moved.distance.at<0>(there).value - box.distance.at<0>(p).value) < 1e-12);
        if (box.distance.at<0>(p).value < 0) CHECK(moved.bounds.contains(there));
    }
}

TEST_CASE("poseBetween: reproduces uniform rotation between frames", "[field]") {
    const double step = 0.3;
    for (const bool before : {true, false})
        for (const bool after : {true, false}) {
            PoseKeys keys = keysOf(roundabout, 0.4, step);
            if (!before) keys.before.reset();
            if (!after) keys.after.reset();
            for (const double part : {0.0, 0.2, 0.5, 0.9, 1.0}) {
                const Pose found = poseBetween(keys, part), exact = roundabout(0.4 + part * step);
                CAPTURE(before, after, part);
                CHECK(length(rotationVector(found.axes * transpose(exact.axes))) < 1e-12);
                // The origin follows a cubic, or a chord if both neighbours are missing.
                CHECK(length(found.origin - exact.origin) < (before || after ? 2e-3 : 0.012));
            }
        }
}

TEST_CASE("poseBetween: is third-order accurate with continuous velocity", "[field]") {
    const auto errorAt = [](double step) {
        return apart(poseBetween(keysOf(tumbling, 0.3, step), 0.4), tumbling(0.3 + 0.4 * step));
    };
    const double coarse = errorAt(0.1), fine = errorAt(0.05);
    CAPTURE(coarse, fine);
    CHECK(fine < 1e-3);
    CHECK(std::log2(coarse / fine) > 2.7);
    // The velocity at a frame, from both sides.
    const double step = 0.3, h = 1e-5;
    const PoseKeys left = keysOf(tumbling, 0.3, step), right = keysOf(tumbling, 0.3 + step, step);
    const Pose here = tumbling(0.3 + step), before = poseBetween(left, 1 - h), after = poseBetween(right, h);
    CHECK(length((here.origin - before.origin) - (after.origin - here.origin)) < 20 * h * h);
    const Vec3d arrives = rotationVector(here.axes * transpose(before.axes)),
                leaves = rotationVector(after.axes * transpose(here.axes));
    CHECK(length(arrives) > 1e-6);
    CHECK(length(arrives - leaves) < 20 * h * h);
}

TEST_CASE("hermiteWeights: reproduce polynomials", "[field]") {
    for (const bool before : {true, false})
        for (const bool after : {true, false}) {
            const int degree =
                before || after ? 2 : 1; // the degree that is reproduced; with both neighbours, a cubic would need more
            for (const double part : {0.0, 0.3, 0.5, 1.0}) {
                const auto w = hermiteWeights(before, after, part);
                if (!before) CHECK(w[0] == 0);
                if (!after) CHECK(w[3] == 0);
                for (int n = 0; n <= degree; ++n) {
                    double sum = 0;
                    for (size_t k = 0; k < 4; ++k) sum += w[k] * std::pow(static_cast<double>(k) - 1, n);
                    CHECK(sum == Approx(std::pow(part, n)).margin(1e-14));
                }
            }
        }
}

TEST_CASE("hermiteSlopes: are the derivatives of the weights", "[field]") {
    for (const bool before : {true, false})
        for (const bool after : {true, false})
            for (const double part : {0.0, 0.3, 0.5, 1.0}) {
                constexpr double kStep = 1e-4;
                const auto slopes = hermiteSlopes(before, after, part),
                           above = hermiteWeights(before, after, part + kStep),
                           below = hermiteWeights(before, after, part - kStep);
                for (size_t k = 0; k < 4; ++k) // the differences of a cubic are off by about 5 step²
                    CHECK(slopes[k] == Approx((above[k] - below[k]) / (2 * kStep)).margin(1e-7));
            }
}
