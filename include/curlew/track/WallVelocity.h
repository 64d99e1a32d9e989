// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Bound.h"
#include "curlew/flow/FlowInTime.h"
#include "curlew/track/Points.h"

#include <optional>
#include <vector>

namespace curlew {

/// The velocity w that a moving wall adds to a flow c that conforms to it: u = c + w is the velocity in the space in
/// which the wall moves. At the wall, w is the wall's velocity. It fades out across the wall's layer (Wall::width), as
/// in WallMotion, which moves points by it. docs/math.md has the derivation.
///
/// For a rigid wall, w is a sum of terms ∇((1−α) a) × ∇b, up to two for its translation and one for its rotation, so it
/// is divergence-free. Inside a body (Side::outside), w continues as the body's own motion. A wall that changes its
/// form has the normal velocity -(∂d/∂t) ∇d / |∇d|² and, if it is known, the tangential part of the velocity of its
/// surface (Sdf::surfaceVelocity). w is (1−α) times their sum, which is not divergence-free; it fades out on both
/// sides.
///
/// Immutable, safe to share between threads.
class WallVelocity {
  public:
    /// Takes the wall now, `step` seconds later and twice `step` later (earlier if the step is negative). Its pose and
    /// distance are differentiated in time by the three-point formula, which is exact for motion that is quadratic in
    /// time; the error is second order in the step. If the wall is unbounded, its form is compared in `box`. Throws
    /// ValueError if the sides differ.
    WallVelocity(const Wall& now, const Wall& next, const Wall& afterNext, double step, const Box& box);

    bool still() const { return mStill; }
    bool rigid() const { return mRigid; } ///< The wall moves without changing its form.
    /// The potentials of w if the wall is rigid and moves: a sum of at most three terms.
    const std::vector<Flow::Potentials>& terms() const { return mTerms; }

    /// Speeds in world units per second.
    struct Speeds {
        double wall = 0; ///< Of the rigid motion.
        double air = 0;  ///< Of w.
    };
    /// Returns the greatest speeds at 1024 positions in and around a rigid wall, in `box` if it is unbounded; zeros if
    /// the wall is not rigid. The air is faster than the wall, because all that the wall displaces passes it within the
    /// layer: at about R/w times the speed of a ball of radius R with a layer of width w.
    Speeds speeds(const Box& box) const;

    /// Evaluates w at the positions, world units per second.
    void eval(const PointBatch& points, VecBatch<double>& velocity) const;
    /// Returns the range of distances from the wall outside which w is zero.
    DistanceRange range() const;
    /// Returns whether w is zero within `radius` of a position.
    bool isFar(const Vec3d& position, double radius) const;

  private:
    void differentiatePoses(const Pose& now, const Pose& next, const Pose& afterNext);

    Wall mWall;
    std::optional<std::pair<Wall, Wall>> mLater; ///< Only if the wall changes its form.
    double mStep = 0;
    bool mStill = false, mRigid = false;
    Vec3d mCentre, mTranslation, mRotation; ///< Per second; the rotation vector is about mCentre.
    std::vector<Flow::Potentials> mTerms;
    std::optional<Flow> mSum; ///< Of the terms.
};

/// Returns the velocity of a flow's wall at a time, from its motion over `interval` seconds (negative: before it).
/// The pose of a rigid wall is differentiated over a small part of that. The distance of a wall that changes its form
/// is differentiated over all of it, at the same times that advect() samples, because a level set is known less well
/// between its frames. Returns nullopt if there is no wall or the wall rests.
std::optional<WallVelocity> wallVelocity(const FlowInTime& flow, double time, double interval);

/// Adds w to the particles' velocities.
void addWallVelocity(const WallVelocity& wall, Points& particles);

} // namespace curlew
