// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/FlowInTime.h"
#include "curlew/track/Advect.h"

namespace curlew {

/// For how long a flow map freezes a flow that changes, if nothing is said.
inline constexpr double kFrozenSeconds = 0.01;

struct FlowMapOptions {
    /// The longest time step, seconds; all steps of a pathline are equally long. 0: steps as long as `accuracy` allows.
    /// With an accuracy, too, the accuracy rules, and a flow that changes is frozen for so long (by default for
    /// kFrozenSeconds).
    double step = 0;
    std::optional<Scheme> scheme = {};     ///< As in AdvectOptions.
    ReprojectionOptions reprojection = {}; ///< In a flow with tracks.
    double accuracy = 0;                   ///< As in AdvectOptions.
};

/// The accuracy that is used for what is interpolated between voxels, relative to their size, if none is given.
inline constexpr double kVoxelAccuracy = 1e-3;

/// The options with that accuracy, if they ask for one and do not say which.
inline FlowMapOptions forVoxels(FlowMapOptions options, double voxelSize) {
    if (options.step == 0 && options.accuracy == 0) options.accuracy = kVoxelAccuracy * voxelSize;
    return options;
}

struct FlowMapResult {
    size_t points = 0;
    size_t stalled = 0; ///< Points that some step left in place, since not even its smallest part was accepted.
};

/// The flow map X: where the points that a flow carries are at another time, later or earlier.
///
/// A flow with tracks is followed with reprojection (track/Advect.h). A sum is followed as a whole, and its wall
/// guarded. One that changes with time is frozen at the middle of each step: second order in time, and within a step
/// points keep to the track of the frozen flow. In a steady flow, and within such a step, points are as accurate as
/// asked for, or have the order of the scheme in steps of equal length. A flow with tracks or a wall that changes also
/// costs, per step, what measuring its potentials does: about 1e5 evaluations.
///
/// On the far side of a wall points follow the flow's continuation, which is tangent to the wall: so the map is smooth
/// across the wall, and no point crosses it. Immutable; calls from one thread at a time, since that is what FlowInTime
/// promises.
class FlowMap {
  public:
    /// Throws ValueError for a step that is negative or not finite.
    explicit FlowMap(FlowInTime flow, const FlowMapOptions& options = {});

    bool steady() const { return mFlow.steady(); }
    const FlowMapOptions& options() const { return mOptions; }

    /// Into how many steps, or parts in which a flow that changes is frozen, it divides the time.
    int steps(double from, double to) const;

    /// Moves points from where they are at the time `from` to where they are at `to`. A point's path does not depend on
    /// the others. Points that are no numbers stay so. Throws ValueError for times that are not finite, or too far
    /// apart for the step.
    FlowMapResult carry(std::vector<Vec3d>& points, double from, double to, const Monitor& monitor = {}) const;

  private:
    AdvectOptions advectOptions(double time, int count, const Domain& domain) const;
    /// In a flow with tracks or a wall. Returns how many points stalled.
    size_t follow(std::vector<Vec3d>& points, double from, double to, int count, const Monitor& monitor) const;

    FlowInTime mFlow;
    FlowMapOptions mOptions;
};

} // namespace curlew
