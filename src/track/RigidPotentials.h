// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Bound.h"
#include "curlew/flow/Flow.h"

#include <vector>

// Potentials a and b of rigid motions with the velocity ∇a × ∇b. Faded in the layer of a wall, ∇((1−α) a) × ∇b is what
// the wall adds to a flow.
namespace curlew {

/// Where a wall is and how far it extends, for its potentials. They are zero in its middle. Measured from elsewhere,
/// they would be large at the wall, and so would the velocities of the air in its layer.
struct WallExtent {
    Vec3d middle; ///< Of its bounds; the point of an unbounded wall that is closest to the middle of the box.
    Vec3d squares, normal;

    WallExtent(const Wall& wall, const Box& box);
    /// Returns the bilinear form whose value along a unit vector, between() with itself, is the square of the distance
    /// from the middle to the side of the bounds. An unbounded wall extends as far as the box, but not along its
    /// normal.
    double between(const Vec3d& a, const Vec3d& b) const;
};

/// A part of a translation: potentials of one that is `share` of it.
struct Push {
    Flow::Potentials potentials;
    double share; ///< 0 to 1.
    double reach; ///< How far the wall extends where the air goes, from its middle.
};

/// Returns the parts of a translation, one or two: around the wall in the plane of the motion and a vector p, and in
/// that of the motion and a vector q, where p and q are the axes of the wall's extent across the motion. The shares are
/// inverse to the squares of the extents along p and q, so that the air goes the short way around. Around a ball, it
/// goes in all directions alike: there the sum is the curl of (1−α) ½ V × x, which Bridson et al. 2007 blend.
std::vector<Push> translationPotentials(const Vec3d& velocity, const WallExtent& extent);

/// `turning`: the rotation vector, along the axis through the centre, radians (per second).
Flow::Potentials rotationPotentials(const Vec3d& turning, const Vec3d& centre);

} // namespace curlew
