// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/Formula.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flow.h"
#include "curlew/track/Advect.h"
#include "support/Points.h"
#include "support/Samples.h"

#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

constexpr double kRing = 0.6, kTube = 0.35; // radii of a torus about the z axis
constexpr double kTurn = 2 * std::numbers::pi;

/// The torus as the zero of a polynomial of degree 4. Its gradient is three times as long on the outer equator as on
/// the inner one.
ScalarField torus() {
    return formulaField([](const auto& x, const auto& k) {
        const auto ring = x[0] * x[0] + x[1] * x[1], sum = ring + x[2] * x[2] + k(kRing * kRing - kTube * kTube);
        return sum * sum - k(4 * kRing * kRing) * ring;
    });
}

/// The share of the torus's area with angles about the tube from 0 to `angle`.
double areaUpTo(double angle) { return (angle + kTube / kRing * std::sin(angle)) / kTurn; }

/// `count` points that are uniform by area.
Points evenly(size_t count) {
    Points points;
    for (size_t k = 0; k < count; ++k) {
        const double share = randomUniform(3, k, 0), around = kTurn * randomUniform(3, k, 1);
        double lower = 0, upper = kTurn; // bisection: areaUpTo() increases
        for (int step = 0; step < 60; ++step)
            (areaUpTo(0.5 * (lower + upper)) < share ? lower : upper) = 0.5 * (lower + upper);
        const double rho = kRing + kTube * std::cos(lower);
        points.x.push_back(rho * std::cos(around));
        points.y.push_back(rho * std::sin(around));
        points.z.push_back(kTube * std::sin(lower));
        points.id.push_back(static_cast<int64_t>(k));
    }
    return points;
}

constexpr int kBins = 16; // along each angle, of the same area

/// Pearson's chi² of the numbers of points in kBins x kBins parts of the torus of the same area.
double chiSquared(const Points& points) {
    std::vector<double> count(size_t{kBins} * kBins);
    for (size_t k = 0; k < points.size(); ++k) {
        const Vec3d p = points.position(k);
        const auto turned = [](double angle) { return angle < 0 ? angle + kTurn : angle; };
        const double share = areaUpTo(turned(std::atan2(p[2], std::hypot(p[0], p[1]) - kRing)));
        const double around = turned(std::atan2(p[1], p[0])) / kTurn;
        const auto bin = [](double part) { return std::clamp(static_cast<int>(part * kBins), 0, kBins - 1); };
        ++count[static_cast<size_t>(bin(share) * kBins + bin(around))];
    }
    const double expected = static_cast<double>(points.size()) / static_cast<double>(count.size());
    double sum = 0;
    for (const double n : count) sum += (n - expected) * (n - expected) / expected;
    return sum;
}

} // namespace

TEST_CASE("advect: points on a level set stay on it, and stay evenly spread if the flow preserves its area",
          "[track]") {
    const Flow plain(noiseField<Psrd3>({.seed = 2}, {.frequency = 1.5}), torus());
    const auto moved = [](const Flow& flow, size_t count) {
        Points points = evenly(count);
        advect(withSpeed(flow, 1), points, {.time = 3, .steps = 40});
        return points;
    };
    // chi² with 255 degrees of freedom has the mean 255 and the standard deviation 22.6; 5 of them are 368.
    constexpr size_t kPoints = samples(100000);
    constexpr double kMost = 368;
    CHECK(chiSquared(evenly(kPoints)) < kMost);
    const Points even = moved(plain.onLevelSets(), kPoints);
    CHECK(chiSquared(even) < kMost);
    double off = 0;
    for (size_t k = 0; k < even.size(); ++k) off = std::max(off, std::abs(torus().at<0>(even.position(k)).value));
    CHECK(off < 1e-7); // reprojection is to 1e-8 of the rms of the potential
    // The divergence-free flow preserves the volume between level sets, which is thicker inside the ring.
    if (!kSanitized) CHECK(chiSquared(moved(plain, kPoints / 5)) > 2 * kMost);
}
