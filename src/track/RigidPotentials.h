// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Bound.h"
#include "curlew/flow/Flow.h"

#include <vector>

// Potentials a and b of rigid motions with the velocity ∇a × ∇b. Faded in the layer of a wall, ∇((1−α) a) × ∇b is what
// the wall adds to a flow.
namespace curlew {

/// The middle of a wall and its extent, for its potentials. They are zero in the middle. If they were zero elsewhere,
/// they would be large at the wall, and so would the velocities of the air in its layer.
struct WallExtent {
    Vec3d middle;  ///< Of its bounds; of an unbounded wall, the point closest to the middle of the box.
    Vec3d squares; ///< Half the size of its bounds along x, y and z, squared; of an unbounded wall, that of the box's
                   ///< diagonal.
    Vec3d normal;  ///< Of an unbounded wall, as long as half the box's diagonal; 0 if the wall is bounded.

    WallExtent(const Wall& wall, const Box& box);
    /// Returns aᵀSb, where S has the squares on its diagonal, less normal ⊗ normal. For a unit vector a, aᵀSa is the
    /// square of the extent along it: half the size of the bounds if a is an axis, 0 along the normal.
    double between(const Vec3d& a, const Vec3d& b) const;
};

/// A part of a translation: potentials of one that is `share` of it.
struct Push {
    Flow::Potentials potentials;
    double share; ///< 0 to 1.
    double reach; ///< The extent of the wall along p or q, which the air has to pass.
};

/// Returns the parts of a translation, one or two: around the wall in the plane of the motion and a vector p, and in
/// that of the motion and a vector q, where p and q are the axes of the wall's extent across the motion. The shares are
/// inverse to the squares of the extents along p and q, so that the air goes the short way around. Around a ball, it
/// goes in all directions alike: there the sum is the curl of (1−α) ½ V × x, which Bridson et al. 2007 blend.
std::vector<Push> translationPotentials(const Vec3d& velocity, const WallExtent& extent);

/// `turning`: the rotation vector, along the axis through the centre, radians (per second).
Flow::Potentials rotationPotentials(const Vec3d& turning, const Vec3d& centre);

} // namespace curlew
