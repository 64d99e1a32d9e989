#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/FlowInTime.h"
#include "curlew/track/Points.h"
#include "curlew/track/Reproject.h"
#include "curlew/track/Stepper.h"

namespace curlew {

struct AdvectOptions {
    double time = 1; ///< Seconds; negative runs backward.
    int steps = 100;
    Scheme scheme = Scheme::rk4;
    ReprojectionOptions reprojection = {};
    /// Of a scheme with steps of adaptive length (then `steps` have the greatest): the estimated error of a step, world
    /// units.
    double accuracy = 1e-4;
    /// A particle that is younger than `time` moves for its age only: it was born on the way.
    bool byAge = false;
    double maxStep = 0; ///< World units: a step that moves a point farther is halved; 0: any length.
};

template <int N>
struct AdvectResultN {
    size_t points = 0;
    size_t notConverged = 0; ///< Points that some step left in place: even its smallest part found no way on the track.
    size_t stalled = 0;      ///< How often that happened.
    size_t outside = 0;      ///< Points on the wrong side of the wall, or exactly on it, at the end.
    size_t substeps = 0;     ///< Steps and parts of steps that were taken.
    size_t retries = 0;      ///< Steps that were redone in halves.
    size_t coarse = 0;  ///< Substeps beyond `accuracy` or `maxStep` that `maxSubdivisions` did not let become shorter.
    size_t overrun = 0; ///< How often a moving wall left a point on its wrong side.
    double meanIterations = 0; ///< Corrections per substep.
    /// Root mean squares at the end over the points that converged, relative to those of the potentials.
    std::array<double, size_t{N - 1}> residual{};

    /// Adds what the same points did next: counts of steps add up, and what describes the end is that of `later`.
    AdvectResultN& operator+=(const AdvectResultN& later);
};
using AdvectResult = AdvectResultN<3>;

/// Moves particles along the flow (ICN Algorithm 1), reprojecting each step onto the particle's track. The track is
/// what the particles carry (f and g), or else the one they start on. On return they have position, velocity and track.
///
/// With reprojection, no particle crosses the wall of the flow's domain. A step is taken back and redone in halves if
///  - it did not come back onto the track within the tolerance, or it ends on the wrong side;
///  - the wall is within reach of it and it is longer than the wall's width, or a point of its chord lies beyond the
///    wall by more than 1/16 of its length: so no particle jumps through a wall from one part of the domain to another.
/// If `maxSubdivisions` do not help, the particle stays for this step. Particles that start beyond the wall (or on it)
/// stay where they are, and are counted as outside. Each particle's path is its own: the result does not depend on the
/// others, nor on the number of threads. Throws ValueError for steps < 1, values that are not finite, and reprojection
/// in a flow without tracks; Interrupted, with the particles in an unspecified state.
AdvectResult advect(const Flow& flow, Points& particles, const AdvectOptions& options, const Monitor& monitor = {});

/// The same in a flow that changes, from the time `begin` on (seconds). Each step takes the flow frozen as it stands in
/// the middle of the step, and each particle on the track on which it then is: second order in time, on track within
/// each step. A wall that moves takes the particles near it along (WallMotion.h), half of its way before the step and
/// half after, so none ends up beyond it. Tolerances are relative to the flow at the beginning.
AdvectResult advect(const FlowInTime& flow, Points& particles, double begin, const AdvectOptions& options,
                    const Monitor& monitor = {});

/// The same for points alone, in 2 to 7 dimensions.
template <int N>
AdvectResultN<N> advect(const FlowN<N>& flow, std::vector<Vec<double, N>>& points, const AdvectOptions& options,
                        const Monitor& monitor = {});

} // namespace curlew
