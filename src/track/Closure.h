// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "StepGuard.h"

#include <optional>

namespace curlew {

// Where a step meets a plane, and whether it leads back to where its curve began (docs/math.md, Stream curves).

/// The end of a step on a plane.
struct PlaneStep {
    StepResultN<3> result; ///< Of one point.
    double part;           ///< The length of the step, in what the stepper measures.
};

/// The step from tip i, no longer than dt, that ends on the plane through `point` with that normal, by Newton's method;
/// `chord`: the length of the whole step. Returns nullopt if there is none.
std::optional<PlaneStep> stepOnto(const GuardedStepper<3>& stepper, const ActiveTipsN<3>& tips, int i,
                                  const Vec3d& point, const Vec3d& normal, double chord, double dt);

/// Where a curve began, and in which direction it left.
struct Origin {
    Vec3d position, normal;
};

/// A return to the origin.
struct Closure {
    double part; ///< Of the step, in what the stepper measures.
    double gap;  ///< How far from the origin it is, world units.
};

/// Whether the step from tip i to `to`, of length dt, passes the origin nearer than `tolerance`, relative to its chord;
/// and where. Returns nullopt if not.
std::optional<Closure> closureOf(const GuardedStepper<3>& stepper, const ActiveTipsN<3>& tips, int i, const Vec3d& to,
                                 double dt, const Origin& origin, double tolerance);

} // namespace curlew
