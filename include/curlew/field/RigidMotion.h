// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Shapes.h"

#include <optional>

namespace curlew {

/// Moves a shape rigidly from the pose `home`, in which it was made, to the pose `now`, which becomes its pose. Its
/// bounds are the box around the rotated box.
Sdf inPose(const Sdf& sdf, const Pose& home, const Pose& now);

/// The poses of a body in four successive frames: before an interval, at its two ends, and after it. The outer ones may
/// be unknown.
struct PoseKeys {
    std::optional<Pose> before = {};
    Pose from = {}, to = {};
    std::optional<Pose> after = {};
};

/// Interpolates the pose at the fraction `part` (0 … 1) of the interval between two frames. Uses cubic Hermite curves
/// of the origin and of the rotation vector in the body's axes. The slope at a frame is the central difference of its
/// neighbours, or a three-point difference at the end of a sequence. Velocities are therefore continuous between
/// intervals, a uniform rotation stays uniform, and the body keeps its shape. Rotations of half a turn or more between
/// frames are ambiguous.
Pose poseBetween(const PoseKeys& keys, double part);

/// Returns the weights of the four frames in that curve. A missing frame has the weight 0.
std::array<double, 4> hermiteWeights(bool before, bool after, double part);

/// Returns the derivatives of these weights by `part`.
std::array<double, 4> hermiteSlopes(bool before, bool after, double part);

} // namespace curlew
