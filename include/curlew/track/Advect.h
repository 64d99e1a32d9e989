// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/FlowInTime.h"
#include "curlew/track/Points.h"
#include "curlew/track/Reproject.h"
#include "curlew/track/Splitting.h"
#include "curlew/track/Stepper.h"

#include <optional>

namespace curlew {

struct AdvectOptions {
    double time = 1; ///< Seconds; negative runs backward.
    /// So many equal steps. 0: steps as long as `accuracy` allows. With an accuracy, too, the accuracy rules; then this
    /// only is the least number of moments at which a flow that changes is frozen, and the number of segments of
    /// pathlines (0: kMoments).
    int steps = 0;
    /// By default rk45 for steps that `accuracy` rules, which need a scheme that estimates its error (rk23 where a
    /// whole flow is followed with an accuracy from kCoarseAccuracy on), and rk4 for equal ones.
    std::optional<Scheme> scheme = {};
    ReprojectionOptions reprojection = {};
    Splitting splitting = Splitting::none; ///< How a sum is followed.
    /// The most that the estimated error of a step may be, world units; less where a flow with tracks is slower than
    /// its root mean square speed, in proportion: an error along a track is a delay. 0: defaultAccuracy(), unless there
    /// are `steps`. What a point's steps have added up to is in AdvectResult.
    double accuracy = 0;
    /// A particle that is younger than `time` moves for its age only: it was born on the way.
    bool byAge = false;
    double maxStep = 0; ///< World units: a step that moves a point farther is taken in parts; 0: any length.

    bool adaptive() const { return steps == 0 || accuracy > 0; } ///< Whether `accuracy` rules the steps.
    Scheme usedScheme() const { return scheme.value_or(adaptive() ? Scheme::dormandPrince : Scheme::rk4); }
};

/// At how many moments a flow that changes is frozen at least, and how many segments pathlines have, if
/// AdvectOptions::steps is 0.
inline constexpr int kMoments = 100;

/// The accuracy that is used where none is given, relative to the diagonal of the domain's box.
inline constexpr double kDefaultAccuracy = 1e-6;

/// From this accuracy on, relative to that diagonal, rk23 takes fewer evaluations of the flow than rk45 for the same
/// error of the place, and that error is about the accuracy (by a prototype in noise of two octaves; curlew_paper time
/// compares both).
inline constexpr double kCoarseAccuracy = 3e-5;

/// The default accuracy, world units. Throws ValueError if the box is infinite or has no extent.
template <int N>
double defaultAccuracy(const DomainN<N>& domain);

template <int N>
struct AdvectResultN {
    size_t points = 0;
    size_t notConverged = 0; ///< Points that some step left in place: even its smallest part found no way on the track.
    size_t stalled = 0;      ///< How often that happened.
    size_t outside = 0;      ///< Points on the wrong side of the wall, or exactly on it, at the end.
    size_t substeps = 0;     ///< Steps and parts of steps that were taken.
    size_t retries = 0;      ///< Steps that were redone in parts.
    size_t coarse = 0;       ///< Substeps beyond `accuracy` or `maxStep` that could not become shorter.
    size_t overrun = 0;      ///< How often a moving wall left a point on its wrong side.
    double meanIterations = 0; ///< Corrections per substep, those that were not taken included.
    /// The estimated error of the position, world units: what the estimates of a point's steps add up to, on average
    /// over the points, and at most, as delays where the flow is slow (see `accuracy`). In a flow that stretches
    /// distances, errors grow on the way; this does not count that. On the other hand the estimate is that of the less
    /// accurate solution of the pair. 0 for schemes without estimates.
    double errorMean = 0, errorMax = 0;
    size_t moments = 0;  ///< At which a flow that changes was frozen.
    double freezing = 0; ///< What that costs: the estimated error of the place, world units, the mean. 0: not known.
    /// Root mean squares at the end over the points that converged, relative to those of the potentials.
    std::array<double, size_t{N - 1}> residual{};
    Splitting splitting = Splitting::none; ///< How the sum was followed; none for a flow that is no sum.
    /// The greatest distances from the track after a substep, relative to the root mean squares of the potentials. In a
    /// sum that is split: from the tracks of the term whose substep it is, over all terms.
    std::array<double, size_t{N - 1}> drift{};

    /// Adds what the same points did next: counts of steps and errors add up, and what describes the end is that of
    /// `later`.
    AdvectResultN& operator+=(const AdvectResultN& later);
};
using AdvectResult = AdvectResultN<3>;

/// How advect() follows this flow with these options: none for a flow of one term. Throws ValueError for a normalised
/// sum that is to be split: it is no sum of its terms.
template <int N>
Splitting splittingOf(const FlowN<N>& flow, const AdvectOptions& options);

/// Moves particles along the flow (ICN Algorithm 1), reprojecting each step onto the particle's track. The track is
/// what the particles carry (f and g), or else the one they start on. On return they have position, velocity and track.
///
/// Each particle takes steps of its own length, such that the estimated error of none is above `accuracy`. So the
/// answer does not depend on how the time is divided into calls, to that accuracy. Or all take the same number of equal
/// steps, which then decides on the place along the track; on it they are, however large the steps.
///
/// With reprojection, no particle crosses the wall of the flow's domain. A step is taken back and redone in halves if
///  - it did not come back onto the track within the tolerance (unless maxSubdivisions = 0: then it counts as it is
///    after its corrections, as in ICN Algorithm 1), or it ends on the wrong side;
///  - the wall is within reach of it and it is longer than the wall's width, or a point of its chord lies beyond the
///    wall by more than 1/16 of its length, or it leads through a thin part of the wall to that part's other side: so
///    no particle jumps through a wall from one part of the domain to another.
/// If `maxSubdivisions` do not help, the particle stays for this step. Particles that start beyond the wall (or on it)
/// stay where they are, and are counted as outside. Each particle's path is its own: the result does not depend on the
/// others, nor on the number of threads.
///
/// A sum has no tracks, and particles come back without one. They follow it as a whole, and the rules above hold but
/// for the track; or by splitting, and then they hold for each of its terms (Splitting.h). If the sum, or a term of one
/// that is split, goes through the wall, which sumAtWall() tells, still no particle crosses: those that it would take
/// there wait at the wall, and are counted as not converged. Where `reprojection` is none, nothing is guarded.
///
/// Throws ValueError for negative steps, values that are not finite, an accuracy for a scheme that does not estimate
/// its error, and what splittingOf() refuses; Interrupted, with the particles in an unspecified state.
AdvectResult advect(const Flow& flow, Points& particles, const AdvectOptions& options, const Monitor& monitor = {});

/// The same in a flow that changes, from the time `begin` on (seconds). The time is divided into `steps` (0: kMoments);
/// each takes the flow frozen as it stands in its middle, and each particle on the track on which it then is: second
/// order in time, on track within each step. A wall that moves takes the particles near it along (WallMotion.h), half
/// of its way before the step and half after, so none ends up beyond it. Tolerances are relative to the flow at the
/// beginning. `accuracy` is that of the way in the frozen flow and, if it is above 0, of each freezing: if `steps`
/// are too few for it, by an estimate at the beginning, there are more, up to 64 times as many. Equal steps are as they
/// are.
AdvectResult advect(const FlowInTime& flow, Points& particles, double begin, const AdvectOptions& options,
                    const Monitor& monitor = {});

/// The same for points alone, in 2 to 7 dimensions.
template <int N>
AdvectResultN<N> advect(const FlowN<N>& flow, std::vector<Vec<double, N>>& points, const AdvectOptions& options,
                        const Monitor& monitor = {});

} // namespace curlew
