// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/FlowInTime.h"
#include "curlew/track/Advect.h"

namespace curlew {

/// Default duration for which a flow map freezes a time-dependent flow.
inline constexpr double kFrozenSeconds = 0.01;

struct FlowMapOptions {
    /// The longest time step, seconds; all steps of a pathline are equally long. 0: adaptive steps, whose length
    /// `accuracy` determines. If `accuracy` is also given, the steps are adaptive, and a time-dependent flow is frozen
    /// for this duration (default: kFrozenSeconds).
    double step = 0;
    std::optional<Scheme> scheme = {};     ///< As in AdvectOptions.
    ReprojectionOptions reprojection = {}; ///< In a flow with tracks.
    double accuracy = 0;                   ///< As in AdvectOptions.
};

/// Default accuracy for quantities that are interpolated between voxels, relative to the voxel size.
inline constexpr double kVoxelAccuracy = 1e-3;

/// Returns the options with that accuracy filled in if they ask for adaptive steps without an accuracy.
inline FlowMapOptions forVoxels(FlowMapOptions options, double voxelSize) {
    if (options.step == 0 && options.accuracy == 0) options.accuracy = kVoxelAccuracy * voxelSize;
    return options;
}

struct FlowMapResult {
    size_t points = 0;
    size_t stalled = 0; ///< Points that stayed in place in some step because not even its smallest part was accepted.
    size_t overrun = 0; ///< How often a moving wall left a point on its wrong side (AdvectResult::overrun).
};

/// The flow map X: the positions, at an earlier or later time, of points that a flow carries.
///
/// A flow with tracks is followed with reprojection (track/Advect.h). A sum is followed as a whole and guarded at its
/// wall. A time-dependent flow is frozen at the middle of each step: this is second order in time, and within a step
/// points keep to the track of the frozen flow. In a steady flow, and within such a step, points are as accurate as
/// requested, or converge with the order of the scheme in steps of equal length. A time-dependent flow with tracks or a
/// wall also costs about 1e5 evaluations per step to measure its potentials.
///
/// On the far side of a wall, points follow the flow's continuation, which is tangent to the wall. So the map is smooth
/// across the wall, and no point crosses it. Around a moving wall, points follow u = c + w, as particles do
/// (WallMotion.h): they are pushed by the wall and carried by its surface. On its far side they stay there and move
/// with it within the width of the layer. Immutable. Call it from one thread at a time, as FlowInTime requires.
class FlowMap {
  public:
    /// Throws ValueError if the step is negative or not finite.
    explicit FlowMap(FlowInTime flow, const FlowMapOptions& options = {});

    bool steady() const { return mFlow.steady(); }
    const FlowMapOptions& options() const { return mOptions; }

    /// Returns the number of steps into which the time is divided: equal steps, or the parts for each of which a
    /// time-dependent flow is frozen.
    int steps(double from, double to) const;

    /// Moves points from their positions at the time `from` to their positions at `to`. No point influences another.
    /// NaN positions pass through unchanged. Throws ValueError if a time is not finite or the times are too far apart
    /// for the step.
    FlowMapResult carry(std::vector<Vec3d>& points, double from, double to, const Monitor& monitor = {}) const;

  private:
    AdvectOptions advectOptions(double time, int count, const Domain& domain) const;
    /// Moves the points of a flow with tracks or a wall.
    FlowMapResult follow(std::vector<Vec3d>& points, double from, double to, int count, const Monitor& monitor) const;

    FlowInTime mFlow;
    FlowMapOptions mOptions;
};

} // namespace curlew
