// SPDX-License-Identifier: Apache-2.0
#include "RigidPotentials.h"

#include "curlew/field/Algebra.h"
#include "curlew/field/Formula.h"
#include "curlew/flow/Flows.h"

#include <algorithm>
#include <cmath>

namespace curlew {

WallExtent::WallExtent(const Wall& wall, const Box& box) {
    const bool bounded = wall.sdf.bounds.finite();
    const Box& around = bounded ? wall.sdf.bounds : box;
    middle = (around.lower + around.upper) * 0.5;
    const Vec3d half = around.size() * 0.5;
    for (int axis = 0; axis < 3; ++axis) squares[axis] = bounded ? half[axis] * half[axis] : dot(half, half);
    if (bounded) return;
    const auto d = wall.sdf.distance.at<1>(middle);
    const double slope = length(d.gradient);
    if (!(slope > 0)) return;
    middle += d.gradient * (-d.value / (slope * slope));
    normal = d.gradient * (length(half) / slope);
}

double WallExtent::between(const Vec3d& a, const Vec3d& b) const {
    double sum = -dot(a, normal) * dot(b, normal);
    for (int axis = 0; axis < 3; ++axis) sum += squares[axis] * a[axis] * b[axis];
    return sum;
}

std::vector<Push> translationPotentials(const Vec3d& velocity, const WallExtent& extent) {
    constexpr double kLeast = 1e-3; // a smaller share is not worth a pair of potentials
    constexpr double kRound = 1e-9; // relative, more than rounding
    const Flow uniform = uniformFlow(velocity);
    const double speed = length(velocity);
    const Vec3d u = uniform.f().at<1>({}).gradient * (1 / speed), v = uniform.g().at<1>({}).gradient;
    const double uu = extent.between(u, u), uv = extent.between(u, v), vv = extent.between(v, v);
    // p is the longer axis, or any if they are equal to rounding: then u, so that it does not turn at random.
    const bool round = std::abs(uv) + std::abs(uu - vv) <= kRound * (uu + vv);
    const double turn = round ? 0 : 0.5 * std::atan2(2 * uv, uu - vv);
    const Vec3d p = u * std::cos(turn) + v * std::sin(turn), q = v * std::cos(turn) - u * std::sin(turn);
    const double alongP = std::max(extent.between(p, p), 0.0), alongQ = std::max(extent.between(q, q), 0.0);
    double share = alongP + alongQ > 0 ? alongQ / (alongP + alongQ) : 0.5; // of the air that goes along p
    if (share < kLeast) share = 0;
    const auto ramp = [&](const Vec3d& slope) { return rampField(slope, -dot(slope, extent.middle)); };
    std::vector<Push> parts;
    if (share > 0) parts.push_back({{ramp(p * (speed * share)), ramp(q)}, share, std::sqrt(alongP)});
    if (share < 1) parts.push_back({{ramp(q * (speed * (1 - share))), ramp(p * -1.0)}, 1 - share, std::sqrt(alongQ)});
    return parts;
}

Flow::Potentials rotationPotentials(const Vec3d& turning, const Vec3d& centre) {
    const double angle = length(turning);
    const Vec3d axis = turning * (1 / angle);
    const auto a = formulaField([c = centre, n = axis, factor = -angle / 2](const auto& x, const auto& k) {
        const auto y = x - std::remove_cvref_t<decltype(x)>{{k(c[0]), k(c[1]), k(c[2])}};
        const auto along = y[0] * k(n[0]) + y[1] * k(n[1]) + y[2] * k(n[2]);
        return (dot(y, y) - along * along) * k(factor);
    });
    return {a, rampField(axis, -dot(axis, centre))};
}

} // namespace curlew
