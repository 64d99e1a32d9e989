// SPDX-License-Identifier: Apache-2.0
#include "Closure.h"

namespace curlew {

std::optional<PlaneStep> stepOnto(const GuardedStepper<3>& stepper, const ActiveTipsN<3>& tips, int i,
                                  const Vec3d& point, const Vec3d& normal, double chord, double dt) {
    const ActiveTipsN<3> one = tips.only(i);
    const double lower = std::min(dt, 0.0), upper = std::max(dt, 0.0);
    Vec3d position = one.position[0], velocity = one.velocity[0];
    double part = 0;
    for (int iteration = 0; iteration < 10; ++iteration) { // Newton's method
        const double off = dot(normal, position - point);
        const double next = part - off / dot(normal, stepper.paced(velocity));
        if (!std::isfinite(next)) return {};
        part = std::clamp(next, lower, upper);
        const StepResultN<3> step = stepper(one, {part});
        if (!step.accepted[0]) return {};
        position = step.position[0], velocity = step.reprojected.velocity[0];
        if (std::abs(dot(normal, position - point)) <= 1e-10 * chord + 1e-15 * length(position))
            return PlaneStep{step, part};
    }
    return {};
}

std::optional<Closure> closureOf(const GuardedStepper<3>& stepper, const ActiveTipsN<3>& tips, int i, const Vec3d& to,
                                 double dt, const Origin& origin, double tolerance) {
    const Vec3d from = tips.position[i];
    const double chord = length(to - from);
    if (!(length(from - origin.position) < 2 * chord) || !(dot(origin.normal, from - origin.position) < 0) ||
        !(dot(origin.normal, to - origin.position) >= 0))
        return {};
    const auto landed = stepOnto(stepper, tips, i, origin.position, origin.normal, chord, dt);
    if (!landed) return {};
    const double gap = length(landed->result.position[0] - origin.position);
    if (!(gap <= tolerance * chord)) return {};
    return Closure{landed->part, gap};
}

} // namespace curlew
