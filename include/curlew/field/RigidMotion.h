// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Shapes.h"

#include <optional>

namespace curlew {

/// A shape that was made in the pose `home` and now is in the pose `now`: carried and turned as a whole. Its pose is
/// `now`. Bounds: the box around the turned box.
Sdf inPose(const Sdf& sdf, const Pose& home, const Pose& now);

/// The poses of a body in four frames one after another: before the interval, at its ends, and after it. The outer ones
/// may be unknown.
struct PoseKeys {
    std::optional<Pose> before = {};
    Pose from = {}, to = {};
    std::optional<Pose> after = {};
};

/// The pose on the way from one frame to the next, `part` = 0 … 1 of it: a cubic Hermite curve of the origin, and of
/// the rotation vector in the body's axes, whose slopes at a frame are central differences of its neighbours (or
/// three-point differences at an end). So velocities are continuous from interval to interval, a uniform turn stays
/// one, and a body keeps its form. Turns of half a turn from frame to frame and more are ambiguous.
Pose poseBetween(const PoseKeys& keys, double part);

/// The weights of the four frames in that curve. Without a frame at an end its weight is 0.
std::array<double, 4> hermiteWeights(bool before, bool after, double part);

} // namespace curlew
