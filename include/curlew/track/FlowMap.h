#pragma once

#include "curlew/flow/FlowInTime.h"
#include "curlew/track/Advect.h"

namespace curlew {

struct FlowMapOptions {
    double step = 0.01; ///< The longest time step, seconds; all steps of a pathline are equally long.
    Scheme scheme = Scheme::rk4;
    ReprojectionOptions reprojection = {}; ///< In a flow with tracks.
};

struct FlowMapResult {
    size_t points = 0;
    size_t stalled = 0; ///< Points that some step left in place, since not even its smallest part was accepted.
};

/// The flow map X: where the points that a flow carries are at another time, later or earlier.
///
/// A flow with tracks is followed with reprojection (track/Advect.h), others without. One that changes with time is
/// frozen at the middle of each step: second order in time, and within a step points keep to the track of the frozen
/// flow. A steady flow has the order of the scheme. A flow with tracks that changes also costs, per step, what
/// measuring its potentials does: about 1e5 evaluations.
///
/// On the far side of a wall points follow the flow's continuation, which is tangent to the wall: so the map is smooth
/// across the wall, and no point crosses it. Immutable; calls from one thread at a time, since that is what FlowInTime
/// promises.
class FlowMap {
  public:
    /// Throws ValueError for a step that is not positive and finite.
    explicit FlowMap(FlowInTime flow, const FlowMapOptions& options = {});

    bool steady() const { return mFlow.steady(); }
    const FlowMapOptions& options() const { return mOptions; }

    /// How many steps it takes.
    int steps(double from, double to) const;

    /// Moves points from where they are at the time `from` to where they are at `to`. A point's path does not depend on
    /// the others. Points that are no numbers stay so. Throws ValueError for times that are not finite, or too far
    /// apart for the step.
    FlowMapResult carry(std::vector<Vec3d>& points, double from, double to, const Monitor& monitor = {}) const;

  private:
    /// In a flow with tracks. Returns how many points stalled.
    size_t follow(std::vector<Vec3d>& points, double from, double to, int count, const Monitor& monitor) const;

    FlowInTime mFlow;
    FlowMapOptions mOptions;
};

} // namespace curlew
