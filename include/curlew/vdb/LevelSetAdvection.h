// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/FlowMap.h"
#include "curlew/vdb/LevelSet.h"

#include <memory>

namespace curlew {

struct AdvectedLevelSet {
    LevelSet levelSet;
    size_t traced = 0;  ///< Voxels traced back along the flow.
    size_t stalled = 0; ///< Traced voxels that some step left in place (FlowMapResult::stalled).
    size_t overrun = 0; ///< How often a moving wall left a traced voxel on its wrong side (FlowMapResult::overrun).
    size_t unconverged =
        0; ///< Voxels whose distance is measured to a nearby surface point that may not be the closest.
    /// Value of the linear interpolant of the result at the points where edges between voxels cross the surface, in
    /// voxels: mean and maximum of its magnitude. 0 would be exact.
    double meanShift = 0, greatestShift = 0;
    bool restarted = false; ///< A LevelSetSequence restarted from this level set.
};

/// Advects the surface of a level set with a flow, from the time `begin` for `time` seconds (negative: backward).
///
/// φ(x, t) = φ₀(X(x, -t)), where X is the flow map and φ₀ the C² spline of the original. The original is interpolated
/// once, however long the time is, so nothing diffuses. φ is evaluated only near the advected surface, which is found
/// by following the original surface. Closest points of the surface then turn φ into a distance again, with the half
/// width of the original, without moving the surface (docs/math.md). A part that is thinner than a voxel at the end
/// time is missing in the result; one that is so thin only in between is kept.
///
/// Cost: about 7 voxels across the surface for each surface voxel, each traced back over the whole time. The distances
/// cost about as much as 20 steps of a simple flow. The default accuracy is a thousandth of a voxel per step
/// (forVoxels).
///
/// Throws ValueError if nothing is left that the voxels resolve, ResourceError if the surface becomes too large, and
/// whatever FlowMap and FlowInTime throw.
AdvectedLevelSet advectLevelSet(const LevelSet& levelSet, const FlowInTime& flow, double begin, double time,
                                const FlowMapOptions& options = {}, const Monitor& monitor = {});

struct LevelSetSequenceOptions {
    FlowMapOptions map = {}; ///< The default accuracy is that of forVoxels().
    /// The flow map reaches back at most this many seconds. After that, the level set of the moment becomes the new
    /// original. Infinity: never. Each restart resamples the surface once, which moves it by about 0.001 voxels where
    /// it is smooth, but loses or thickens sheets of two voxels and less (docs/math.md has figures).
    double horizon = std::numeric_limits<double>::infinity();
};

/// Advects a level set from one time to the next, for an animation.
///
/// The sequence keeps the surface, so finding it again costs only the time between two frames. In a steady flow it also
/// keeps the flow map at the voxels: the origins of voxels that are still near the surface are only continued, X(x, -t
/// - s) = X(X(x, -t), -s), without interpolation. Voxels that are new are traced back to the last restart. In an
/// unsteady flow all voxels are. So the horizon bounds the cost of a frame, not the length of the sequence. Without a
/// horizon the result is as good as if each frame were computed on its own.
class LevelSetSequence {
  public:
    LevelSetSequence(const LevelSet& levelSet, FlowInTime flow, double begin,
                     const LevelSetSequenceOptions& options = {}, const Monitor& monitor = {});
    ~LevelSetSequence();
    LevelSetSequence(LevelSetSequence&&) noexcept;
    LevelSetSequence& operator=(LevelSetSequence&&) noexcept;

    double time() const;
    /// Returns the level set at another time, usually a later one. Throws as advectLevelSet() does; the sequence then
    /// stays at its previous time.
    AdvectedLevelSet advance(double time, const Monitor& monitor = {});

  private:
    class Implementation;
    std::unique_ptr<Implementation> mImplementation;
};

/// Advects a level set by OpenVDB's LevelSetAdvection (HJ-WENO5, TVD Runge-Kutta of order 3, as many steps as its CFL
/// condition requires), for comparison. It samples the flow itself instead of a velocity grid, including the velocity
/// of a moving wall (WallVelocity.h). Beyond its wall the flow continues as in FlowMap. Throws ValueError if nothing is
/// left, or if OpenVDB rejects the level set.
LevelSet advectLevelSetWeno5(const LevelSet& levelSet, const FlowInTime& flow, double begin, double time,
                             const Monitor& monitor = {});

} // namespace curlew
