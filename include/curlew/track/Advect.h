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
    /// Number of equal steps. 0: adaptive steps, whose length `accuracy` determines. If `accuracy` is also given, the
    /// steps are adaptive, and this is only the minimum number of times at which a time-dependent flow is frozen and
    /// the number of segments of pathlines (0: kMoments).
    int steps = 0;
    /// Default: rk4 for equal steps; for adaptive steps, which need a scheme that estimates its error, rk45. It is rk23
    /// if the flow is not split and `accuracy` is at least kCoarseAccuracy.
    std::optional<Scheme> scheme = {};
    ReprojectionOptions reprojection = {};
    Splitting splitting = Splitting::none; ///< How to follow a sum of flows.
    /// Upper bound on the estimated error of a step, world units. In a flow with tracks an error along a track is a
    /// delay, so the bound is lower in proportion where the flow is slower than its root mean square speed. 0:
    /// defaultAccuracy(), unless `steps` is given. AdvectResult has the sum of these estimates over a point's steps.
    double accuracy = 0;
    /// A particle younger than `time` moves with the flow only for its age, because it was born during this time. Near
    /// a moving wall, its position is understood relative to the wall at the end of this time. Without a flow, it ends
    /// there.
    bool byAge = false;
    double maxStep = 0; ///< World units. A step that moves a point farther is subdivided; 0: no limit.

    bool adaptive() const { return steps == 0 || accuracy > 0; }
    Scheme usedScheme() const { return scheme.value_or(adaptive() ? Scheme::dormandPrince : Scheme::rk4); }
};

/// Default for AdvectOptions::steps == 0: the minimum number of times at which a time-dependent flow is frozen, and the
/// number of segments of pathlines.
inline constexpr int kMoments = 100;

/// The default accuracy, relative to the diagonal of the domain's box.
inline constexpr double kDefaultAccuracy = 1e-6;

/// At this accuracy and coarser ones, relative to that diagonal, rk23 takes fewer evaluations of the flow than rk45 for
/// the same position error, and that error is close to the accuracy. Measured with a prototype in noise of two octaves;
/// curlew_paper time compares both.
/// Velocities within adaptive steps are then computed in float, whose rounding errors are far smaller. Those at the
/// ends of steps are in double, and so are the tracks.
inline constexpr double kCoarseAccuracy = 3e-5;

/// Returns the default accuracy in world units. Throws ValueError if the box is infinite or has no extent.
template <int N>
double defaultAccuracy(const DomainN<N>& domain);

template <int N>
struct AdvectResultN {
    size_t points = 0;
    size_t notConverged = 0; ///< Points with a step that was not taken: its shortest part missed the track.
    size_t stalled = 0;      ///< Number of such steps.
    /// Points that at the end are on the wrong side of the wall, or closer to it than float rounding (classify()).
    size_t outside = 0;
    size_t substeps = 0;       ///< Steps and parts of steps taken.
    size_t retries = 0;        ///< Steps that were subdivided and redone.
    size_t coarse = 0;         ///< Substeps that exceed `accuracy` or `maxStep` but could not be shortened.
    size_t overrun = 0;        ///< How often a moving wall left a point on its wrong side.
    double meanIterations = 0; ///< Corrections per substep, including those of rejected steps.
    /// Estimated position error, world units: the sum of the estimates of a point's steps, its mean over the points and
    /// its maximum. Where the flow is slow, the estimates are weighted as delays (see `accuracy`). The sum ignores that
    /// a flow which stretches distances amplifies earlier errors. Each estimate is that of the less accurate solution
    /// of the pair, so it is pessimistic. Of several parts of the time, the maxima are added, so errorMax is then only
    /// an upper bound on that of one point. 0 for schemes without estimates.
    double errorMean = 0, errorMax = 0;
    size_t moments = 0;  ///< Number of times at which a time-dependent flow was frozen.
    double freezing = 0; ///< Mean estimated position error due to freezing, world units. 0: unknown.
    /// Root mean square residuals at the end over the converged points, relative to the root mean squares of the
    /// potentials.
    std::array<double, size_t{N - 1}> residual{};
    Splitting splitting = Splitting::none; ///< How the sum was followed; `none` if the flow is not a sum.
    /// Largest residuals after a substep, relative to the root mean squares of the potentials. In a sum that is split,
    /// the residuals are those of the term that the substep follows; the maximum is over all terms.
    std::array<double, size_t{N - 1}> drift{};

    /// Adds the result of a later step of the same points. Counts of steps and errors are added; values that describe
    /// the end are those of `later`.
    AdvectResultN& operator+=(const AdvectResultN& later);
};
using AdvectResult = AdvectResultN<3>;

/// Returns how advect() follows this flow with these options: `none` for a flow of one term. Throws ValueError if a
/// normalised sum is to be split, because it is not the sum of its terms.
template <int N>
Splitting splittingOf(const FlowN<N>& flow, const AdvectOptions& options);

/// Moves particles along the flow and reprojects each step onto the particle's track (ICN Algorithm 1). The track is
/// the one that a particle carries (f and g), or else the one on which it starts. On return, particles have position,
/// velocity and track.
///
/// By default each particle takes adaptive steps whose estimated error is at most `accuracy`. To that accuracy the
/// result does not depend on how the time is divided into calls. Alternatively, all particles take the same number of
/// equal steps. Their number then determines the error along the track, but particles stay on the track for any step
/// size.
///
/// With reprojection, no particle crosses the wall of the flow's domain. A step is rejected and redone in halves if
///  - it did not return to the track within the tolerance (if maxSubdivisions = 0, the step is instead accepted as its
///    corrections leave it, as in ICN Algorithm 1), or it ends on the wrong side;
///  - the wall is within reach of the step, and the step is longer than the wall's width, or a point of its chord lies
///    beyond the wall by more than 1/16 of the chord's length, or the step crosses a thin part of the wall to the other
///    side of that part. So no particle jumps through a wall from one part of the domain to another.
/// If `maxSubdivisions` halvings do not suffice, the particle stays in place for this step. Particles that start beyond
/// the wall or on it stay where they are and are counted as outside. No particle influences another, so the result does
/// not depend on the number of threads.
///
/// A sum has no tracks, and particles return without one. A sum is followed as a whole, and then the rules above apply
/// except for the track; or it is split, and then they apply to each of its terms (Splitting.h). If the sum, or a term
/// of a sum that is split, flows through the wall (see sumAtWall()), particles still do not cross it: they wait at the
/// wall and are counted as not converged. If `reprojection` is `none`, nothing is guarded.
///
/// Throws ValueError if `steps` is negative, a value is not finite, an accuracy is given for a scheme without error
/// estimates, or splittingOf() throws. Throws Interrupted on cancellation and leaves the particles in an unspecified
/// state.
AdvectResult advect(const Flow& flow, Points& particles, const AdvectOptions& options, const Monitor& monitor = {});

/// The same in a time-dependent flow, starting at the time `begin` (seconds). The time is divided into `steps` parts
/// (0: kMoments). In each part, the flow is frozen at the middle of the part, and each particle follows the track on
/// which it then is: second order in time, and on track within each part. A moving wall carries the particles near it
/// (WallMotion.h), half of its motion before the part and half after, so no particle ends up beyond it. Tolerances are
/// relative to the flow at the beginning. `accuracy` applies to the steps in the frozen flow. If it is above 0, it also
/// applies to the error of freezing: if an estimate at the beginning shows that `steps` is too small, there are more
/// parts, up to 64 times as many. If `accuracy` is 0, there are exactly `steps` parts.
AdvectResult advect(const FlowInTime& flow, Points& particles, double begin, const AdvectOptions& options,
                    const Monitor& monitor = {});

/// The same for bare points, in 2 to 7 dimensions.
template <int N>
AdvectResultN<N> advect(const FlowN<N>& flow, std::vector<Vec<double, N>>& points, const AdvectOptions& options,
                        const Monitor& monitor = {});

} // namespace curlew
