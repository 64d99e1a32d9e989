// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/Rail.h"
#include "support/FiniteDifference.h"
#include "support/Points.h"

#include <numbers>

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;

namespace {

constexpr double kTurn = 2 * std::numbers::pi;

std::vector<Vec3d> helix(size_t count) {
    std::vector<Vec3d> points;
    for (size_t k = 0; k < count; ++k) {
        const double t = 1.5 * kTurn * static_cast<double>(k) / static_cast<double>(count - 1);
        points.push_back({{0.8 * std::cos(t), 0.8 * std::sin(t), 0.15 * t}});
    }
    return points;
}

std::vector<Vec3d> circle(size_t count, double wave = 0) {
    std::vector<Vec3d> points;
    for (size_t k = 0; k < count; ++k) {
        const double t = kTurn * static_cast<double>(k) / static_cast<double>(count);
        points.push_back({{std::cos(t), std::sin(t), wave * std::sin(2 * t)}});
    }
    return points;
}

/// A position near the rail, and the distance along the rail at which it is.
Vec3d nearRail(const Rail& rail, double radius, uint64_t k) {
    const Vec3d at = rail.at(rail.length() * randomUniform(1, k, 0));
    return at + randomPoint(cube(radius / std::sqrt(3.0)), 2, k);
}

} // namespace

TEST_CASE("Rail: goes through its points, smoothly", "[field]") {
    for (const bool closed : {false, true}) {
        const auto points = closed ? circle(12, 0.3) : helix(20);
        const Rail rail(points, closed);
        CHECK(rail.closed() == closed);
        for (const Vec3d& p : points) CHECK(rail.nearest(p).distance < 1e-14);
        // Steps along it have the length of the distance, and turn gradually.
        constexpr int kSteps = 1000;
        const double step = rail.length() / kSteps;
        Vec3d before = rail.at(step) - rail.at(0);
        for (int k = 1; k + 1 < kSteps; ++k) {
            const Vec3d now = rail.at((k + 1) * step) - rail.at(k * step);
            CAPTURE(k);
            CHECK(length(now) == Approx(step).epsilon(1e-3));
            CHECK(dot(now, before) > 0.999 * step * step);
            before = now;
        }
    }
}

TEST_CASE("Rail: points of a circle make the circle", "[field]") {
    const Rail rail(circle(5), true);
    CHECK(rail.length() == Approx(kTurn).epsilon(1e-13));
    CHECK(rail.sharpestBend().radius == Approx(1).epsilon(1e-12));
    for (uint64_t k = 0; k < 200; ++k) {
        const Vec3d p = randomPoint(cube(2), 3, k);
        const double expected = std::hypot(std::hypot(p[0], p[1]) - 1, p[2]);
        CHECK(rail.nearest(p).distance == Approx(expected).margin(1e-13));
    }
    const Rail line(std::vector<Vec3d>{{{0, 0, 0}}, {{1, 0, 0}}, {{1, 0, 0}}, {{3, 0, 0}}});
    CHECK(line.length() == Approx(3));
    CHECK(std::isinf(line.sharpestBend().radius));
    // It goes on beyond its ends.
    CHECK(line.nearest({{-5, 0.3, 0}}).distance == Approx(0.3));
    CHECK(line.nearest({{9, 0, 0.4}}).distance == Approx(0.4));
}

TEST_CASE("Rail: the nearest arc is that of a search through all points", "[field]") {
    const Rail rail(helix(60));
    for (uint64_t k = 0; k < 100; ++k) {
        const Vec3d p = randomPoint(cube(1), 4, k) + Vec3d{{0, 0, 0.7}};
        double least = 1e9;
        for (int s = 0; s <= 4000; ++s) least = std::min(least, length(p - rail.at(rail.length() * s / 4000)));
        const double found = rail.nearest(p).distance;
        CAPTURE(p);
        CHECK(found <= least + 1e-12);
        // Samples are 1/4000 of the length apart; beyond the ends, the straight lines may be nearer.
        if (const double half = rail.length() / 8000; std::abs(found - least) > half) {
            const Vec3d start = p - rail.at(0), end = p - rail.at(rail.length());
            CHECK(std::min(length(start), length(end)) < 2.5);
            CHECK(found < least);
        }
    }
}

TEST_CASE("Rail: u and v have unit gradients across the curve, whose cross product is the tangent", "[field]") {
    const std::vector<RailPointer> rails{std::make_shared<Rail>(helix(20)),
                                         std::make_shared<Rail>(circle(12, 0.3), true)};
    for (const RailPointer& rail : rails)
        for (uint64_t k = 0; k < 300; ++k) {
            const Vec3d p = nearRail(*rail, 0.2, k);
            const auto near = rail->nearest(p);
            const auto [u, v] = rail->across<2>(near.arc, p);
            CAPTURE(p, rail->closed());
            CHECK(std::hypot(u.value, v.value) == Approx(near.distance).margin(1e-13));
            if (rail->closed()) continue; // its frame turns
            CHECK(length(u.gradient) == Approx(1).epsilon(1e-12));
            CHECK(length(v.gradient) == Approx(1).epsilon(1e-12));
            CHECK(std::abs(dot(u.gradient, v.gradient)) < 1e-12);
        }
}

TEST_CASE("Rail: derivatives are those of the values", "[field]") {
    for (const double turns : {0.0, 0.7})
        for (const bool closed : {false, true}) {
            const auto rail = std::make_shared<Rail>(closed ? circle(12, 0.3) : helix(20), closed, turns);
            for (const int axis : {0, 1}) {
                const ScalarField field = acrossRails({rail}, axis);
                std::vector<double> gradients, hessians;
                constexpr double kStep = 1e-5;
                for (uint64_t k = 0; k < 200; ++k) {
                    const Vec3d p = nearRail(*rail, 0.2, k);
                    const auto jet = field.at<2>(p);
                    double gradient = 0, hessian = 0;
                    for (int i = 0; i < 3; ++i) {
                        const auto up = field.at<1>(p + unit<3>(i) * kStep), down = field.at<1>(p - unit<3>(i) * kStep);
                        gradient += std::abs((up.value - down.value) / (2 * kStep) - jet.gradient[i]);
                        for (int j = 0; j < 3; ++j)
                            hessian += std::abs((up.gradient[j] - down.gradient[j]) / (2 * kStep) - jet.hessian(i, j));
                    }
                    gradients.push_back(gradient);
                    hessians.push_back(hessian);
                }
                CAPTURE(turns, closed, axis);
                // Differences are off by h² times the third derivative, and by roundings of 1e-16 / h; where arcs meet
                // within the step, second derivatives jump.
                CHECK(median(gradients) < 1e-8);
                CHECK(median(hessians) < 1e-7);
                CHECK(*std::max_element(gradients.begin(), gradients.end()) < 1e-3);
            }
        }
}

TEST_CASE("Rail: the coordinates of a closed curve are continuous where it closes", "[field]") {
    for (const double turns : {0.0, 0.4}) {
        const auto rail = std::make_shared<Rail>(circle(12, 0.3), true, turns);
        const Vec3d p = rail->at(0) + Vec3d{{0.1, 0, 0.05}};
        const Vec3d ahead = (rail->at(1e-6) - rail->at(rail->length() - 1e-6)) * 0.5;
        for (const int axis : {0, 1}) {
            const ScalarField field = acrossRails({rail}, axis);
            CHECK(std::abs(field.at<0>(p + ahead).value - field.at<0>(p - ahead).value) < 1e-5);
        }
    }
}

TEST_CASE("tubeSdf: the distance to the nearest rail less the radius", "[field]") {
    const auto line = std::make_shared<Rail>(std::vector<Vec3d>{{{0, 0, 0}}, {{1, 0, 0}}});
    const auto ring = std::make_shared<Rail>(circle(9), true);
    const Sdf both = tubeSdf({line, ring}, 0.1);
    CHECK(!both.bounds.finite());
    CHECK(both.distance.at<0>({{0.3, 0.05, 0}}).value == Approx(-0.05));
    CHECK(both.distance.at<0>({{0.3, 0, 0}}).value == Approx(-0.1));
    CHECK(both.distance.at<0>({{0, 1.3, 0}}).value == Approx(0.2));
    const Sdf closed = tubeSdf({ring}, 0.1);
    CHECK(closed.bounds.finite());
    CHECK(closed.bounds.upper[0] >= 1.1);
    CHECK_THROWS_WITH(tubeSdf({ring}, 0), ContainsSubstring("radius"));
    CHECK_THROWS_WITH(tubeSdf({}, 0.1), ContainsSubstring("no rails"));
}

TEST_CASE("Rail: bad points, sharp bends and tubes that touch are errors", "[field]") {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const Vec3d origin, ahead{{1, 0, 0}};
    using Points = std::vector<Vec3d>;
    CHECK_THROWS_WITH(Rail(Points{origin}), ContainsSubstring("2 different points"));
    CHECK_THROWS_WITH(Rail(Points{origin, origin}), ContainsSubstring("2 different points"));
    CHECK_THROWS_WITH(Rail(Points{origin, ahead}, true), ContainsSubstring("closed"));
    CHECK_THROWS_WITH(Rail(Points{origin, Vec3d{{nan, 0, 0}}}), ContainsSubstring("finite"));
    const auto ring = std::make_shared<Rail>(circle(12), true);
    CHECK_NOTHROW(requireSeparate({ring}, 0.9));
    CHECK_THROWS_WITH(requireSeparate({ring}, 1.1), ContainsSubstring("bend"));
    const auto near = std::make_shared<Rail>(std::vector<Vec3d>{{{1.3, -1, 0}}, {{1.3, 1, 0}}});
    CHECK_NOTHROW(requireSeparate({ring, near}, 0.14));
    CHECK_THROWS_WITH(requireSeparate({ring, near}, 0.16), ContainsSubstring("touch"));
    // A curve that turns back: a half circle.
    const Rail back(Points{origin, ahead, origin});
    CHECK(back.length() > 2);
    CHECK(std::isfinite(back.length()));
}

TEST_CASE("Rail: gradients are continuous where arcs meet, with and without turns", "[field]") {
    for (const double turns : {0.0, 1.0}) {
        const std::vector<Vec3d> bends{{{-1, 0, 0}}, {{-0.3, 0.4, 0.2}}, {{0.3, -0.2, 0}}, {{1, 0.2, 0.1}}};
        const auto rail = std::make_shared<Rail>(bends, false, turns);
        for (const int axis : {0, 1}) {
            const ScalarField field = acrossRails({rail}, axis);
            double most = 0;
            // Neighbouring positions on curves beside the rail.
            for (const Vec3d& beside : {Vec3d{{0.1, 0, 0.05}}, Vec3d{{-0.1, 0.1, 0}}}) {
                const auto at = [&](int k) {
                    return field.at<1>(rail->at(rail->length() * k / 20000) + beside).gradient;
                };
                for (int k = 0; k < 20000; ++k) most = std::max(most, length(at(k + 1) - at(k)));
            }
            CAPTURE(turns, axis, most);
            CHECK(most < 0.01); // the second derivative, about 10, times the step of 4e-4
        }
    }
}

TEST_CASE("Rail: turns in finite arcs where its points double back", "[field]") {
    const auto onLine = [](const std::vector<double>& coordinates) {
        std::vector<Vec3d> points;
        for (const double x : coordinates) points.push_back({{x, 0, 0}});
        return points;
    };
    const std::vector<Vec3d> bent{{{1, 0.1, 0}}, {{0, 0, 0}}, {{3, 0, 0}}, {{2, -0.1, 0}}};
    const std::vector<Vec3d> nearLine{{{0, 0, 0}}, {{3, 0, 0}}, {{2, 1e-9, 0}}};
    for (const auto& points : {onLine({0, 3, 2}), onLine({0, 3, 2, 5}), onLine({0, 1e-7, -5}), bent, nearLine}) {
        const Rail rail(points);
        CAPTURE(points.size(), points[1], points[2]);
        CHECK(rail.length() < 70); // `bent` turns in two large arcs
        for (const Vec3d& p : points) CHECK(rail.nearest(p).distance < 1e-12);
        const double step = rail.length() / 100000;
        double sharpest = 1; // of the cosines between successive steps
        Vec3d before = rail.at(step) - rail.at(0);
        for (int k = 1; k < 100000; ++k) {
            const Vec3d now = rail.at((k + 1) * step) - rail.at(k * step);
            sharpest = std::min(sharpest, dot(now, before) / (step * step));
            before = now;
        }
        if (length(points[1] - points[0]) > 1e-3) CHECK(sharpest > 0.999);
    }
    CHECK(Rail(onLine({0, 3, 2, 4, 1}), true).length() < 40);
}
