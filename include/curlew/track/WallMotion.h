// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/field/Bound.h"
#include "curlew/track/Points.h"

#include <vector>

namespace curlew {

/// What a wall does to the points near it while it moves from one place, or form, to another: at the wall they move as
/// it does, and its layer (Wall::width) takes the rest along less and less. No point ends up on the other side of it.
/// docs/math.md has the derivation.
///
/// A wall that keeps its form is followed by a divergence-free flow, of its translation and its rotation apart (the
/// construction of Bridson et al. 2007, with potentials that are constant along its streamlines). It is known from
/// Sdf::pose, and from the distances being the same in both poses. A wall that changes its form has a normal velocity
/// only, -(∂d/∂t) ∇d / |∇d|²; following it changes volumes, as the wall does.
class WallMotion {
  public:
    /// From one wall to the other, which has the same side and width; `box`: where points are. Throws ValueError where
    /// sides differ.
    WallMotion(const Wall& from, const Wall& to, const Box& box);

    bool still() const { return mStill; } ///< Both are the same, as far as 1024 samples tell.
    bool rigid() const { return mRigid; }
    /// The most that the distance from a wall changes that changes its form, world units; 0 for others.
    double way() const { return mWay; }

    /// Moves the points. Points beyond the wall at the start stay where they are. Returns how many, not counting those,
    /// the wall left on its wrong side: it moved by more than its samples reach, and fewer or shorter steps may help.
    size_t carry(std::vector<Vec3d>& points, const Monitor& monitor = {}) const;
    size_t carry(Points& particles, const Monitor& monitor = {}) const;

  private:
    void carryRigidly(std::vector<Vec3d>& points, const Monitor& monitor) const;
    void carryAlongNormals(std::vector<Vec3d>& points, const Monitor& monitor) const;

    Wall mFrom, mTo;
    Box mBox;
    bool mStill = false, mRigid = false;
    double mWay = 0;
    Vec3d mCentre, mTranslation, mAxis; ///< The rotation is about mAxis, a unit vector, through mCentre.
    double mAngle = 0;                  ///< Radians.
};

/// The most that the distance from a wall is off the mean of those before and after it, as far as 1024 samples tell.
double offMean(const Wall& before, const Wall& middle, const Wall& after, const Box& box);

/// How much of a wall, 0 to 1, moves so far that its distances do not tell the way: what was inside is in the end
/// farther from the wall than its distance is known for. Walls whose form is known in between, which is not the mean of
/// both ends (Sdf::reach), never do.
double partLost(const Wall& begin, const Wall& middle, const Wall& end, const Box& box);

} // namespace curlew
