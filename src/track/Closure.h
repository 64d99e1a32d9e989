// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "StepGuard.h"

#include <optional>

namespace curlew {

// Intersects a step with a plane, and detects whether a curve returns to its start (docs/math.md, Stream curves).

/// A step that ends on a plane.
struct PlaneStep {
    StepResultN<3> result; ///< For one point.
    double part;           ///< The length of the step, in the stepper's units (StepBy).
};

/// Returns the step from tip i, at most dt long, that ends on the plane through `point` with that normal; found by
/// Newton's method. `chord`: the length of the whole step. Returns nullopt if there is none.
std::optional<PlaneStep> stepOnto(const GuardedStepper<3>& stepper, const ActiveTipsN<3>& tips, int i,
                                  const Vec3d& point, const Vec3d& normal, double chord, double dt);

/// The start of a curve and its initial direction.
struct Origin {
    Vec3d position, normal;
};

/// A return to the origin.
struct Closure {
    double part; ///< Length of the step up to the return, in the stepper's units (StepBy).
    double gap;  ///< Distance from the origin, world units.
};

/// Returns the closure if the step of length dt from tip i to `to` passes the origin within `tolerance`, relative to
/// its chord. Otherwise returns nullopt.
std::optional<Closure> closureOf(const GuardedStepper<3>& stepper, const ActiveTipsN<3>& tips, int i, const Vec3d& to,
                                 double dt, const Origin& origin, double tolerance);

} // namespace curlew
