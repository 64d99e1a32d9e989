// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "TrackKernels.h"
#include "WallCrossing.h"
#include "curlew/track/Curves.h"
#include "curlew/track/Reproject.h"
#include "curlew/track/Stepper.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace curlew {

/// A batch of points about to take a step.
template <int N>
struct ActiveTipsN {
    PointBatchN<N> position;
    VecBatchN<double, N> velocity;
    TrackBatchN<N> track;
    std::array<double, kBatch> distance; ///< From the domain's wall.

    void copy(int to, const ActiveTipsN& from, int i) {
        position.set(to, from.position[i]);
        velocity.set(to, from.velocity[i]);
        for (size_t q = 0; q < track.size(); ++q)
            track[q][static_cast<size_t>(to)] = from.track[q][static_cast<size_t>(i)];
        distance[static_cast<size_t>(to)] = from.distance[static_cast<size_t>(i)];
    }
    ActiveTipsN only(int i) const {
        ActiveTipsN one;
        one.position.size = 1;
        one.copy(0, *this, i);
        return one;
    }
};

/// Returns the tips at these points, each on the track at its position. Sets `allowed` to whether the point is on a
/// side of the wall where the flow is.
template <int N>
ActiveTipsN<N> tipsAt(const FlowN<N>& flow, const PointBatchN<N>& points, std::array<bool, kBatch>& allowed) {
    ActiveTipsN<N> tips;
    tips.position = points;
    typename FlowN<N>::template Jets<double> potentials;
    flow.eval(points, potentials, tips.velocity);
    for (size_t q = 0; q < tips.track.size(); ++q) tips.track[q] = potentials[q].c[0];
    classify(flow.domain(), points, allowed, tips.distance);
    return tips;
}

/// The conditions on a step. The caller halves a step that violates them.
struct StepGuard {
    bool convergence = true; ///< Reprojection met its tolerance.
    /// The step ends on an allowed side of the wall, the one on which it began, and its chord does not cross the wall
    /// (rejectChords, rejectCrossings).
    bool walls = true;
    /// The end is finite. Implied by `convergence` if the potentials are unbounded.
    bool finite = false;
    /// Maximum distance by which reprojection may move the end, relative to the step's length; 0: unlimited. Near a
    /// stagnation point a correction can undo the whole step, so a streamline would oscillate there.
    double maxCorrection = 0;

    /// Guard for particles: nothing is guarded without reprojection. If steps cannot be halved, they are accepted as
    /// the corrections leave them (ICN Algorithm 1).
    static StepGuard forAdvection(const ReprojectionOptions& options) {
        const bool guarded = options.method != Reprojection::none;
        return {.convergence = guarded && options.maxSubdivisions > 0, .walls = guarded};
    }
    /// Guard for streamlines: they end at a wall even without reprojection.
    static StepGuard forStreamlines(Reprojection method) {
        return {.convergence = method != Reprojection::none, .finite = true, .maxCorrection = 0.5};
    }
};

/// Returns whether a point is allowed and still on the same side of the wall.
inline bool staysOnSide(bool allowed, double distance, double distanceBefore) {
    return allowed && (distance < 0) == (distanceBefore < 0);
}

/// Rejects steps near the wall that are longer than its width or whose chord passes through it: a point of the chord
/// lies beyond the wall by more than 1/16 of the chord's length. `chord`: lengths of the steps; `distance`: from the
/// wall at `from`.
template <int N>
void rejectChords(const DomainN<N>& domain, const PointBatchN<N>& from, const PointBatchN<N>& to,
                  const std::array<double, kBatch>& chord, const std::array<double, kBatch>& distance,
                  std::array<bool, kBatch>& accepted) {
    if (!domain.wall) return;
    const WallN<N>& wall = *domain.wall;
    constexpr int kSamples = 3;
    PointBatchN<N> samples;
    std::array<int, kBatch> owner;
    const auto judge = [&] {
        JetBatchN<double, N, 0> d;
        wall.sdf.distance.eval(samples, d);
        for (size_t s = 0; s < static_cast<size_t>(samples.size); ++s) {
            const auto i = static_cast<size_t>(owner[s]);
            // The side on which the chord must stay: for `both`, the side on which it began.
            const Side side = wall.side != Side::both ? wall.side : distance[i] < 0 ? Side::inside : Side::outside;
            if (!(beyondWall(side, d.c[0][s]) <= chord[i] / 16)) accepted[i] = false;
        }
        samples.size = 0;
    };
    for (int i = 0; i < from.size; ++i) {
        const auto k = static_cast<size_t>(i);
        if (!accepted[k] || std::abs(distance[k]) > wall.sdf.lipschitz * chord[k]) continue;
        if (chord[k] > wall.width) {
            accepted[k] = false;
            continue;
        }
        const Vec<double, N> move = to[i] - from[i];
        if (samples.size + kSamples > kBatch) judge();
        for (int sample = 1; sample <= kSamples; ++sample) {
            owner[static_cast<size_t>(samples.size)] = i;
            samples.push(from[i] + move * (double(sample) / (kSamples + 1)));
        }
    }
    judge();
}

/// The result of one step of each tip.
template <int N>
struct StepResultN {
    PointBatchN<N> position;
    ReprojectedBatchN<N> reprojected;
    std::array<double, kBatch> distance; ///< From the wall; unset if the guard ignores walls.
    std::array<double, kBatch> error;    ///< Estimated, world units; see StepDemands::rmsSpeed.
    std::array<bool, kBatch> accepted;
};

/// Accuracy demands on steps. By default the error estimate is ignored, and all steps are reprojected fully.
struct StepDemands {
    double accuracy = std::numeric_limits<double>::infinity(); ///< World units.
    /// The rms speed of the flow; 0: unknown. An error along a track is a delay and stays one. Where the flow is slower
    /// than this speed, the error is weighted by the distance that it grows to where the flow is this fast.
    double rmsSpeed = 0;
    /// Intermediate steps, whose end no caller sees. They are reprojected by one correction without another evaluation,
    /// and the next step begins with the velocity found before that correction.
    std::array<bool, kBatch> between{};
    /// Computes the velocities within a step in float. Those at its ends, and all that depends on them, are in double.
    bool floatStages = false;
};

/// Takes one step of every tip of a batch, reprojects it, and accepts or rejects it. Particles, streamlines, flow maps
/// and image warps all use it. Code whose points have no track calls step() directly: a warp with a given number of
/// steps, as ICN measures it, and points that a moving wall pushes.
template <int N>
class GuardedStepper {
  public:
    /// `by`: what dt measures. By length, the flow's direction field is integrated at unit speed.
    GuardedStepper(const FlowN<N>& flow, StepBy by, Scheme scheme, const ReprojectOptionsN<N>& reprojection,
                   const StepGuard& guard)
        : mFlow(flow),
          mPace(by == StepBy::length ? flow.normalized(1) : flow),
          mBy(by),
          mScheme(scheme),
          mReprojection(reprojection),
          mGuard(guard) {}

    const FlowN<N>& flow() const { return mFlow; }
    bool guardsWalls() const { return mGuard.walls; }
    /// Returns the derivative of the position with respect to what dt measures.
    Vec<double, N> paced(const Vec<double, N>& velocity) const {
        const double speed = mBy == StepBy::length ? length(velocity) : 0;
        return speed > 0 ? velocity * (1 / speed) : velocity;
    }

    StepResultN<N> operator()(const ActiveTipsN<N>& from, const std::array<double, kBatch>& dt,
                              const StepDemands& demands = {}) const {
        const int size = from.position.size;
        StagesN<N> stages;
        stages[0] = paced(from.velocity, size);
        StepResultN<N> to;
        const auto within = [&](const PointBatchN<N>& p, VecBatchN<double, N>& v) {
            if (!demands.floatStages) return mPace.velocity(p, v);
            VecBatchN<float, N> rounded;
            mPace.velocity(p, rounded);
            for (size_t axis = 0; axis < N; ++axis)
                for (size_t i = 0; i < static_cast<size_t>(p.size); ++i)
                    v.c[axis][i] = static_cast<double>(rounded.c[axis][i]);
        };
        step(mScheme, from.position, dt, within, stages, to.position);
        const PointBatchN<N> stepped = to.position;
        FlowBatchN<N> here;
        mFlow.eval(stepped, here.potentials, here.velocity);
        const auto difference = estimatedDifference(mScheme, size, stages, paced(here.velocity, size));
        runKernel<StepErrorKernel<N>, double>(std::as_const(size), difference, dt, from.velocity,
                                              std::as_const(here.velocity), demands.rmsSpeed, to.error);
        std::array<double, kBatch> stepLength, near{};
        runKernel<LengthKernel<N>, double>(from.position, stepped, stepLength);
        if (mReprojection.method == Reprojection::gaussNewton)
            runKernel<NearTrackKernel<N>, double>(std::as_const(here.potentials), std::as_const(size), from.track,
                                                  demands.accuracy, near);
        std::array<Correction, kBatch> wanted;
        for (size_t k = 0; k < static_cast<size_t>(size); ++k) {
            const bool blind = demands.between[k] && near[k] != 0;
            // A step that will be redone needs no correction.
            wanted[k] = to.error[k] > demands.accuracy ? Correction::none
                        : blind                        ? Correction::once
                                                       : Correction::fully;
        }
        reproject(mFlow, to.position, from.track, stepLength, mReprojection, wanted, here, to.reprojected);
        for (size_t k = 0; k < static_cast<size_t>(size); ++k)
            if (wanted[k] != Correction::fully) to.reprojected.converged[k] = true;
        judge(from, stepped, stepLength, to);
        return to;
    }

  private:
    VecBatchN<double, N> paced(const VecBatchN<double, N>& velocity, int size) const {
        if (mBy == StepBy::time) return velocity;
        VecBatchN<double, N> pace;
        for (int i = 0; i < size; ++i) pace.set(i, paced(velocity[i]));
        return pace;
    }

    void judge(const ActiveTipsN<N>& from, const PointBatchN<N>& stepped, const std::array<double, kBatch>& stepLength,
               StepResultN<N>& to) const {
        std::array<bool, kBatch> allowed;
        if (mGuard.walls) classify(mFlow.domain(), to.position, allowed, to.distance);
        for (int i = 0; i < from.position.size; ++i) {
            const auto k = static_cast<size_t>(i);
            const Vec<double, N> p = to.position[i];
            bool accepted = !mGuard.convergence || to.reprojected.converged[k];
            if (mGuard.walls) accepted = accepted && staysOnSide(allowed[k], to.distance[k], from.distance[k]);
            if (mGuard.finite)
                accepted = accepted && std::all_of(p.c.begin(), p.c.end(), [](double x) { return std::isfinite(x); });
            if (mGuard.maxCorrection > 0)
                accepted = accepted && length(p - stepped[i]) <= mGuard.maxCorrection * stepLength[k];
            to.accepted[k] = accepted;
        }
        if (!mGuard.walls) return;
        std::array<double, kBatch> chord;
        runKernel<LengthKernel<N>, double>(from.position, std::as_const(to.position), chord);
        rejectChords(mFlow.domain(), from.position, to.position, chord, from.distance, to.accepted);
        rejectCrossings(mFlow.domain(), from.position, to.position, chord, from.distance, to.distance, to.accepted);
    }

    FlowN<N> mFlow, mPace;
    StepBy mBy;
    Scheme mScheme;
    ReprojectOptionsN<N> mReprojection;
    StepGuard mGuard;
};

} // namespace curlew
