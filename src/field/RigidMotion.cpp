// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/RigidMotion.h"

#include "MapModels.h"
#include "curlew/math/Rotation.h"

#include <algorithm>
#include <cmath>

namespace curlew {

Sdf inPose(const Sdf& sdf, const Pose& home, const Pose& now) {
    const Matrix3 turn = now.axes * transpose(home.axes);
    const Vec3d origin = now.origin - turn * home.origin;
    Sdf moved = sdf;
    moved.distance = ScalarField(detail::Affine<3, 3>{sdf.distance, transpose(turn), origin});
    moved.pose = now;
    moved.surfaceVelocity.reset(); // the pose has the motion
    if (!sdf.bounds.finite()) return moved;
    const Vec3d centre = turn * sdf.bounds.center() + origin, half = sdf.bounds.size() * 0.5;
    Vec3d reach;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) reach[i] += std::abs(turn[i][j]) * half[j];
    moved.bounds = {centre - reach, centre + reach};
    return moved;
}

namespace {

/// The basis of a cubic Hermite curve on [0, 1]: the weights of the values and slopes at its ends.
struct Hermite {
    double from, fromSlope, to, toSlope;
    explicit Hermite(double s)
        : from((1 + 2 * s) * (1 - s) * (1 - s)),
          fromSlope(s * (1 - s) * (1 - s)),
          to(s * s * (3 - 2 * s)),
          toSlope(s * s * (s - 1)) {}
};

/// The derivatives of the basis.
struct HermiteSlopes {
    double from, fromSlope, to, toSlope;
    explicit HermiteSlopes(double s)
        : from(6 * s * (s - 1)), fromSlope((1 - s) * (1 - 3 * s)), to(6 * s * (1 - s)), toSlope(s * (3 * s - 2)) {}
};

/// The slope at an end of the interval from its neighbouring frames, relative to that end: the central difference
/// (ahead - behind) / 2; at the end of a sequence the three-point difference (4 ahead - farAhead) / 2; with neither,
/// `ahead`.
Vec3d slope(const std::optional<Vec3d>& behind, const Vec3d& ahead, const std::optional<Vec3d>& farAhead) {
    if (behind) return (ahead - *behind) * 0.5;
    if (farAhead) return (ahead * 4.0 - *farAhead) * 0.5;
    return ahead;
}

/// The rate of change of the rotation vector φ of a body that rotates by ω in its own axes: the inverse of the right
/// Jacobian times ω (Chirikjian, "Stochastic Models, Information Theory, and Lie Groups", vol. 2, 10.86).
Vec3d rateOfVector(const Vec3d& phi, const Vec3d& omega) {
    const double angle = length(phi);
    const double factor = angle < 1e-3 ? 1.0 / 12 + angle * angle / 720
                                       : 1 / (angle * angle) - (1 + std::cos(angle)) / (2 * angle * std::sin(angle));
    return omega + cross(phi, omega) * 0.5 + cross(phi, cross(phi, omega)) * factor;
}

Vec3d turnOf(const Pose& from, const Pose& to) { return rotationVector(transpose(from.axes) * to.axes); }

template <class Of>
std::optional<Vec3d> ifKnown(const std::optional<Pose>& pose, const Of& of) {
    return pose ? std::optional(of(*pose)) : std::nullopt;
}

} // namespace

Pose poseBetween(const PoseKeys& keys, double part) {
    if (part <= 0) return keys.from;
    if (part >= 1) return keys.to;
    const Hermite h(part);
    const auto offsetFrom = [&](const Pose& p) { return p.origin - keys.from.origin; };
    const auto offsetTo = [&](const Pose& p) { return p.origin - keys.to.origin; };
    const Vec3d offset = offsetFrom(keys.to);
    const Vec3d leaving = slope(ifKnown(keys.before, offsetFrom), offset, ifKnown(keys.after, offsetFrom));
    const Vec3d arriving = -1.0 * slope(ifKnown(keys.after, offsetTo), -1.0 * offset, ifKnown(keys.before, offsetTo));
    const auto turnFrom = [&](const Pose& p) { return turnOf(keys.from, p); };
    const auto turnTo = [&](const Pose& p) { return turnOf(keys.to, p); };
    const Vec3d turn = turnFrom(keys.to);
    const Vec3d spin = slope(ifKnown(keys.before, turnFrom), turn, ifKnown(keys.after, turnFrom));
    const Vec3d spinTo = -1.0 * slope(ifKnown(keys.after, turnTo), -1.0 * turn, ifKnown(keys.before, turnTo));
    const Vec3d phi = spin * h.fromSlope + turn * h.to + rateOfVector(turn, spinTo) * h.toSlope;
    return {keys.from.axes * rotationBy(phi),
            keys.from.origin + leaving * h.fromSlope + offset * h.to + arriving * h.toSlope};
}

namespace {

/// Returns the weights of the four frames in a curve with the basis functions h.
template <class Basis>
std::array<double, 4> frameWeights(bool before, bool after, const Basis& h) {
    std::array<double, 4> w{0, h.from, h.to, 0};
    const auto add = [&](double factor, const std::array<double, 4>& slope) {
        for (size_t k = 0; k < 4; ++k) w[k] += factor * slope[k];
    };
    const std::array<double, 4> straight{0, -1, 1, 0};
    add(h.fromSlope, before ? std::array{-0.5, 0.0, 0.5, 0.0} : after ? std::array{0.0, -1.5, 2.0, -0.5} : straight);
    add(h.toSlope, after ? std::array{0.0, -0.5, 0.0, 0.5} : before ? std::array{0.5, -2.0, 1.5, 0.0} : straight);
    return w;
}

} // namespace

std::array<double, 4> hermiteWeights(bool before, bool after, double part) {
    return frameWeights(before, after, Hermite(part));
}

std::array<double, 4> hermiteSlopes(bool before, bool after, double part) {
    return frameWeights(before, after, HermiteSlopes(part));
}

} // namespace curlew
