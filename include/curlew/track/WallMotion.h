// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/field/Bound.h"
#include "curlew/flow/Flow.h"
#include "curlew/track/Points.h"

#include <vector>

namespace curlew {

/// The motion of points near a wall while the wall moves from one pose, or form, to another. At the wall the points
/// move with it; the motion fades out across the wall's layer (Wall::width). No point ends up on the other side of the
/// wall. docs/math.md has the derivation.
///
/// The points near a rigid wall follow divergence-free flows, two for its translation and one for its rotation (the
/// construction of Bridson et al. 2007, with potentials that are constant along its streamlines). A wall is rigid if
/// Sdf::pose changes and the distances are the same in both poses. A wall that changes its form has a normal velocity,
/// -(∂d/∂t) ∇d / |∇d|². If the velocity of its surface is known (Sdf::surfaceVelocity), the points also move with the
/// tangential part of that, as they move with the surface of a rigid wall. Following such a wall changes volumes, as
/// the wall does.
class WallMotion {
  public:
    /// The motion from one wall to another of the same side and width. `box` contains the points. `seconds`: the time
    /// that the motion takes, negative if it goes backward; it is needed for the tangential motion of surfaces that
    /// deform. Throws ValueError if the sides differ.
    WallMotion(const Wall& from, const Wall& to, const Box& box, double seconds = 0);

    /// Whether both walls are the same, judged by 1024 samples, and no surface moves along itself.
    bool still() const { return mStill; }
    bool rigid() const { return mRigid; }
    /// Maximum change of the distance if the wall changes its form, world units; otherwise 0.
    double maxChange() const { return mMaxChange; }

    /// Moves the points. Points beyond the wall at the start stay in place. Returns the number of other points that
    /// ended on the wall's wrong side. This happens if the wall moves farther than its distance samples reach; shorter
    /// steps may help.
    size_t carry(std::vector<Vec3d>& points, const Monitor& monitor = {}) const;
    size_t carry(Points& particles, const Monitor& monitor = {}) const;

  private:
    void carryRigidly(std::vector<Vec3d>& points, const Monitor& monitor) const;
    void evalSurface(const PointBatch& points, double s, VecBatch<double>& travel) const;
    void carryWithSurface(std::vector<Vec3d>& points, const Monitor& monitor) const;

    Wall mFrom, mTo;
    Box mBox;
    bool mStill = false, mRigid = false;
    double mMaxChange = 0;
    double mSeconds = 0;
    double mSlide = 0; ///< An upper bound on how far points of the surface move if it deforms; 0: unknown.
    Vec3d mCentre, mTranslation, mAxis; ///< The rotation axis mAxis is a unit vector through mCentre.
    double mAngle = 0;                  ///< Radians.
};

/// Returns the maximum difference, over 1024 samples, between the distance from the middle wall and the mean of the
/// distances from those before and after it.
double offMean(const Wall& before, const Wall& middle, const Wall& after, const Box& box);

/// Returns the fraction, 0 to 1, of the wall's inside that moves too far for its distances to show where it goes: in
/// the end it is farther outside the wall than the distance is known (Sdf::reach). Returns 0 if the middle wall is not
/// the mean of both ends but has a known distance of its own.
double partLost(const Wall& begin, const Wall& middle, const Wall& end, const Box& box);

} // namespace curlew
