// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "StepControl.h"
#include "StepGuard.h"
#include "curlew/track/Advect.h"

#include <vector>

namespace curlew::detail {

/// The contribution of one batch to AdvectResult.
template <int N>
struct Tally {
    size_t notConverged = 0, stalled = 0, outside = 0, substeps = 0, retries = 0, coarse = 0, iterations = 0;
    double error = 0, maxError = 0;                      // estimated position errors: sum and maximum
    std::array<double, FlowN<N>::kPotentials> squares{}; // of the residuals
    std::array<double, FlowN<N>::kPotentials> drift{};   // maximum residuals after a substep

    Tally& operator+=(const Tally& o) {
        notConverged += o.notConverged;
        stalled += o.stalled;
        outside += o.outside;
        substeps += o.substeps;
        retries += o.retries;
        coarse += o.coarse;
        iterations += o.iterations;
        error += o.error;
        maxError = std::max(maxError, o.maxError);
        for (size_t q = 0; q < squares.size(); ++q) squares[q] += o.squares[q];
        for (size_t q = 0; q < drift.size(); ++q) drift[q] = std::max(drift[q], o.drift[q]);
        return *this;
    }
};

/// Returns the stepper of advect().
template <int N>
GuardedStepper<N> advectionStepper(const FlowN<N>& flow, const AdvectOptions& options,
                                   const ReprojectOptionsN<N>& reprojection) {
    return {flow, StepBy::time, options.usedScheme(), reprojection, StepGuard::forAdvection(options.reprojection)};
}

/// Moves the points of several batches for the whole time.
template <int N>
class BatchAdvector {
  public:
    /// Starts each point on the track at its position. `options` must have an accuracy unless its steps are equal;
    /// `firstStep`: length of the first adaptive step, seconds; `rmsSpeed`, `floatStages`: see StepDemands.
    BatchAdvector(const GuardedStepper<N>& stepper, const AdvectOptions& options, double firstStep,
                  const std::vector<PointBatchN<N>>& batches, double rmsSpeed = 0, bool floatStages = false)
        : mStepper(stepper),
          mOptions(options),
          mFirstStep(firstStep),
          mRmsSpeed(rmsSpeed),
          mFloatStages(floatStages),
          mParts(batches.size()) {
        for (size_t b = 0; b < batches.size(); ++b) {
            Part& part = mParts[b];
            part.tips.position = batches[b];
            const auto potentials = sample(part);
            for (size_t q = 0; q < part.tips.track.size(); ++q) part.tips.track[q] = potentials[q].c[0];
            part.converged.fill(true);
            part.error.fill(0);
            part.pace.fill(1);
        }
    }

    /// One batch of points.
    struct Part {
        ActiveTipsN<N> tips; ///< With their tracks, which the caller may set.
        std::array<bool, kBatch> allowed, converged;
        std::array<double, kBatch> error; ///< Estimated error of each position.
        std::array<double, kBatch> pace;  ///< The fraction of the time for which each point moves.

        size_t size() const { return static_cast<size_t>(tips.position.size); }
    };
    std::vector<Part>& parts() { return mParts; }

    void run(const Monitor& monitor) {
        if (mOptions.adaptive()) return advanceAdaptively(monitor);
        for (Part& part : mParts)
            for (int k = 0; k < mOptions.steps; ++k) {
                monitor.check(); // the steps of one batch may take hours
                advanceEqually(part);
            }
    }

    /// Counts of the steps so far.
    const Tally<N>& counts() const { return mTally; }

    /// The same, and the residuals of the points at their current positions.
    Tally<N> tally() {
        Tally<N> sum = mTally;
        for (Part& part : mParts) {
            const auto potentials = sample(part);
            for (size_t i = 0; i < part.size(); ++i) {
                sum.outside += !part.allowed[i];
                sum.notConverged += !part.converged[i];
                sum.error += part.error[i];
                sum.maxError = std::max(sum.maxError, part.error[i]);
                if (!part.converged[i]) continue;
                for (size_t q = 0; q < potentials.size(); ++q) {
                    const double residual = potentials[q].c[0][i] - part.tips.track[q][i];
                    sum.squares[q] += residual * residual;
                }
            }
        }
        return sum;
    }

  private:
    using Jets = typename FlowN<N>::template Jets<double>;

    /// A point that has not reached the end of its time.
    struct MovingPoint {
        Part* part;
        size_t index;         ///< In the part.
        double left;          ///< Remaining time, seconds, positive.
        double length;        ///< Length of its next step, seconds.
        int subdivisions = 0; ///< Subdivisions since the guard last accepted a step.
    };

    /// Returns the potentials at the points. Also sets their velocities and their distances from the wall.
    Jets sample(Part& part) const {
        Jets potentials;
        mStepper.flow().eval(part.tips.position, potentials, part.tips.velocity);
        classify(mStepper.flow().domain(), part.tips.position, part.allowed, part.tips.distance);
        return potentials;
    }

    int whole() const { return 1 << mOptions.reprojection.maxSubdivisions; }
    bool stays(const Part& part, size_t i) const { return mStepper.guardsWalls() && !part.allowed[i]; }

    /// Takes one time step of every point. The rest of each step is counted in units of 2^-maxSubdivisions.
    void advanceEqually(Part& part) {
        std::array<size_t, kBatch> active;
        std::array<int, kBatch> left, fraction;
        size_t count = 0;
        for (size_t i = 0; i < part.size(); ++i) {
            if (stays(part, i)) continue;
            left[i] = fraction[i] = whole();
            active[count++] = i;
        }
        const double smallest = mOptions.time / mOptions.steps / whole();
        while (count > 0) {
            ActiveTipsN<N> from;
            std::array<double, kBatch> dt;
            from.position.size = static_cast<int>(count);
            for (size_t a = 0; a < count; ++a) {
                from.copy(static_cast<int>(a), part.tips, static_cast<int>(active[a]));
                dt[a] = smallest * fraction[active[a]] * part.pace[active[a]];
            }
            const StepResultN<N> to = mStepper(from, dt);
            size_t rest = 0;
            for (size_t a = 0; a < count; ++a) {
                const size_t i = active[a];
                if (takeEqual(part, i, from, to, a, fraction[i], left[i])) active[rest++] = i;
            }
            count = rest;
        }
    }

    /// Moves point i to the end of step a, or halves the step. Returns whether any time remains.
    bool takeEqual(Part& part, size_t i, const ActiveTipsN<N>& from, const StepResultN<N>& to, size_t a, int& fraction,
                   int& left) {
        mTally.iterations += static_cast<size_t>(to.reprojected.iterations[a]);
        const bool refine = tooLong(from, to, a);
        if (fraction > 1 && (!to.accepted[a] || refine)) {
            ++mTally.retries;
            fraction /= 2;
            return true;
        }
        if (!to.accepted[a]) {
            stall(part, i);
            return false;
        }
        moveTo(part.tips, i, to, a);
        mTally.coarse += refine;
        left -= fraction;
        return left > 0;
    }

    /// Moves every point by its own adaptive steps. The active batch stays full as long as points remain: when one
    /// arrives, the next one takes its place.
    void advanceAdaptively(const Monitor& monitor) {
        const double time = std::abs(mOptions.time), sign = mOptions.time < 0 ? -1 : 1;
        std::array<MovingPoint, kBatch> moving;
        ActiveTipsN<N> tips; // of `moving`
        size_t nextPart = 0, nextPoint = 0;
        const auto setOut = [&](size_t a) {
            for (; nextPart < mParts.size(); ++nextPart, nextPoint = 0) {
                Part& part = mParts[nextPart];
                while (nextPoint < part.size()) {
                    const size_t i = nextPoint++;
                    const double left = time * part.pace[i];
                    if (stays(part, i) || !(left > 0)) continue;
                    moving[a] = {.part = &part, .index = i, .left = left, .length = mFirstStep};
                    tips.copy(static_cast<int>(a), part.tips, static_cast<int>(i));
                    return true;
                }
            }
            return false;
        };
        size_t count = 0;
        while (count < kBatch && setOut(count)) ++count;
        std::array<double, kBatch> dt;
        StepDemands demands{
            .accuracy = mOptions.accuracy, .rmsSpeed = mRmsSpeed, .between = {}, .floatStages = mFloatStages};
        while (count > 0) {
            monitor.check();
            tips.position.size = static_cast<int>(count);
            for (size_t a = 0; a < count; ++a) {
                const double length = nextStep(moving[a]);
                dt[a] = sign * length;
                // A rejected step may have been too far off its track.
                demands.between[a] = length < moving[a].left && moving[a].subdivisions == 0;
            }
            const StepResultN<N> to = mStepper(tips, dt, demands);
            for (size_t a = count; a-- > 0;) { // from the last, which may take the place of another
                if (takeAdaptive(moving[a], tips, to, a, std::abs(dt[a]))) continue;
                moving[a].part->tips.copy(static_cast<int>(moving[a].index), tips, static_cast<int>(a));
                if (setOut(a) || a == --count) continue;
                moving[a] = moving[count];
                tips.copy(static_cast<int>(a), tips, static_cast<int>(count));
            }
        }
    }

    /// Takes the remaining time in one step or in two equal ones, so that no step becomes very short.
    static double nextStep(const MovingPoint& point) {
        if (point.length * (1 + 1e-9) >= point.left) return point.left;
        return std::min(point.length, point.left / 2);
    }

    /// Moves a point to the end of step a, which took `length` seconds, and chooses the next step. Returns whether any
    /// of its time remains.
    bool takeAdaptive(MovingPoint& point, ActiveTipsN<N>& tips, const StepResultN<N>& to, size_t a, double length) {
        Part& part = *point.part;
        const size_t i = point.index;
        mTally.iterations += static_cast<size_t>(to.reprojected.iterations[a]);
        const double error = to.error[a] / mOptions.accuracy;
        const bool refine = !(error <= 1) || tooLong(tips, to, a);
        const double factor = std::min(mControl.factor(error), stretch(tips, to, a));
        if (refine && length > shortest()) {
            ++mTally.retries;
            point.length = length * factor;
            return true;
        }
        if (!to.accepted[a]) {
            if (point.subdivisions < mOptions.reprojection.maxSubdivisions && length > guardedShortest()) {
                ++mTally.retries;
                ++point.subdivisions;
                point.length = length / 2;
                return true;
            }
            stall(part, i);
            if (!std::isfinite(error)) return false;
            // Skip the whole step, and not a very short one, or this would take forever.
            point.length = std::max(std::ldexp(length, point.subdivisions), usualStep() / 16);
            point.subdivisions = 0;
            return pass(point, point.length);
        }
        if (!std::isfinite(error)) { // even the shortest step is invalid
            stall(part, i);
            return false;
        }
        moveTo(tips, a, to, a);
        mTally.coarse += refine;
        part.error[i] += to.error[a];
        // The step after a halved step is no longer than it.
        point.length = std::max(length * (point.subdivisions > 0 ? std::min(factor, 1.0) : factor), shortest());
        point.subdivisions = 0;
        return pass(point, length);
    }

    static bool pass(MovingPoint& point, double length) {
        if (length >= point.left) return false;
        point.left -= length;
        return true;
    }

    double usualStep() const { return std::min(mFirstStep, std::abs(mOptions.time)); }
    /// Minimum step lengths: the accuracy makes no step shorter than shortest(), and the guard halves none below
    /// guardedShortest(). Otherwise a point that is driven towards a wall would take ever shorter steps.
    double shortest() const { return usualStep() * 0x1p-20; }
    double guardedShortest() const { return std::ldexp(usualStep(), -mOptions.reprojection.maxSubdivisions - 4); }

    void stall(Part& part, size_t i) {
        ++mTally.stalled;
        part.converged[i] = false;
    }

    static double moved(const ActiveTipsN<N>& from, const StepResultN<N>& to, size_t a) {
        return length(to.position[static_cast<int>(a)] - from.position[static_cast<int>(a)]);
    }
    bool tooLong(const ActiveTipsN<N>& from, const StepResultN<N>& to, size_t a) const {
        return mOptions.maxStep > 0 && moved(from, to, a) > mOptions.maxStep;
    }
    /// Returns the factor by which step a may grow so that the point moves by nearly maxStep.
    double stretch(const ActiveTipsN<N>& from, const StepResultN<N>& to, size_t a) const {
        constexpr double kNearly = 0.95, kMax = 4;
        if (!(mOptions.maxStep > 0)) return kMax;
        const double way = moved(from, to, a);
        return way * kMax > mOptions.maxStep ? kNearly * mOptions.maxStep / way : kMax;
    }

    void moveTo(ActiveTipsN<N>& tips, size_t i, const StepResultN<N>& to, size_t a) {
        tips.position.set(static_cast<int>(i), to.position[static_cast<int>(a)]);
        tips.velocity.set(static_cast<int>(i), to.reprojected.velocity[static_cast<int>(a)]);
        if (mStepper.guardsWalls()) tips.distance[i] = to.distance[a];
        ++mTally.substeps;
        for (size_t q = 0; q < mTally.drift.size(); ++q)
            mTally.drift[q] = std::max(mTally.drift[q], std::abs(to.reprojected.residual[q][a]));
    }

    const GuardedStepper<N>& mStepper;
    const AdvectOptions& mOptions;
    double mFirstStep, mRmsSpeed;
    bool mFloatStages;
    StepControl mControl{std::max(tableauOf(mOptions.usedScheme()).errorOrder, 1)};
    std::vector<Part> mParts;
    Tally<N> mTally;
};

} // namespace curlew::detail
