// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Bound.h"
#include "curlew/flow/FlowInTime.h"
#include "curlew/track/Points.h"

#include <optional>
#include <vector>

namespace curlew {

/// The velocity w that a moving wall adds to a flow c that conforms to it: u = c + w is the velocity in the space in
/// which the wall moves. At the wall w is the wall's velocity; it fades out with the wall's layer (Wall::width), as in
/// WallMotion, which moves points by it. docs/math.md has the derivation.
///
/// A rigid wall has a translation and a rotation: w = ∇((1−α) a) × ∇b for each of the two, so it is divergence-free.
/// It goes on in a body (Side::outside) as the body's own motion. A wall that changes its form has a normal velocity,
/// w = -(1−α) (∂d/∂t) ∇d / |∇d|², which is not divergence-free; it fades out on both sides.
///
/// Immutable, safe to share between threads.
class WallVelocity {
  public:
    /// From the wall at one moment, and how it stands `step` and twice `step` seconds later (a negative step: before).
    /// Its pose and distance are differentiated in time by the three-point formula, which is exact for a motion that is
    /// quadratic in time; what is left is of second order in the step. `box`: where its form is compared, if it is
    /// unbounded. Throws ValueError if the sides differ.
    WallVelocity(const Wall& now, const Wall& next, const Wall& afterNext, double step, const Box& box);

    bool still() const { return mStill; }
    bool rigid() const { return mRigid; } ///< It moves without changing its form.
    /// The potentials of w, if the wall is rigid and moves: a sum of at most two terms.
    const std::vector<Flow::Potentials>& terms() const { return mTerms; }

    /// w at the positions, world units per second.
    void eval(const PointBatch& points, VecBatch<double>& velocity) const;
    /// The distances from the wall between which w is not zero.
    DistanceRange range() const;
    /// Whether w is zero within `radius` of a position.
    bool isFar(const Vec3d& position, double radius) const;

  private:
    void differentiatePoses(const Pose& now, const Pose& next, const Pose& afterNext);

    Wall mWall;
    std::optional<std::pair<Wall, Wall>> mLater; ///< Of a wall that changes its form.
    double mStep = 0;
    bool mStill = false, mRigid = false;
    Vec3d mCentre, mTranslation, mRotation; ///< Per second; the rotation vector is about mCentre.
    std::vector<Flow::Potentials> mTerms;
    std::optional<Flow> mSum; ///< Of the terms.
};

/// The velocity of the wall of a flow at a time, from how it moves in `way` seconds from then (negative: before). The
/// pose of a rigid wall is differentiated over a small part of that. The distance of one that changes its form is
/// differentiated over all of it, where the moments are those that advect() looks at: of a level set between frames
/// less is known. nullopt if there is no wall, or if it rests.
std::optional<WallVelocity> wallVelocity(const FlowInTime& flow, double time, double way);

/// Adds w to the velocities of the particles.
void addWallVelocity(const WallVelocity& wall, Points& particles);

} // namespace curlew
