#pragma once

#include "StepGuard.h"
#include "curlew/track/Advect.h"

#include <cstdint>

namespace curlew::detail {

/// What one batch contributes to AdvectResult.
template <int N>
struct Tally {
    size_t notConverged = 0, stalled = 0, outside = 0, substeps = 0, retries = 0, coarse = 0, iterations = 0;
    std::array<double, FlowN<N>::kPotentials> squares{}; // of the residuals

    Tally& operator+=(const Tally& o) {
        notConverged += o.notConverged;
        stalled += o.stalled;
        outside += o.outside;
        substeps += o.substeps;
        retries += o.retries;
        coarse += o.coarse;
        iterations += o.iterations;
        for (size_t q = 0; q < squares.size(); ++q) squares[q] += o.squares[q];
        return *this;
    }
};

/// The stepper of advect().
template <int N>
GuardedStepper<N> advectionStepper(const FlowN<N>& flow, const AdvectOptions& options,
                                   const ReprojectOptionsN<N>& reprojection) {
    return {flow, StepBy::time, options.scheme, reprojection, StepGuard::forAdvection(options.reprojection.method)};
}

/// Moves the points of one batch through all steps.
template <int N>
class BatchAdvector {
  public:
    /// The points, each on the track that it begins on.
    BatchAdvector(const GuardedStepper<N>& stepper, const AdvectOptions& options, const PointBatchN<N>& points)
        : mStepper(stepper), mOptions(options) {
        mTips.position = points;
        const auto potentials = sample();
        for (size_t q = 0; q < mTips.track.size(); ++q) mTips.track[q] = potentials[q].c[0];
        mConverged.fill(true);
        mPart.fill(whole());
        mPace.fill(1);
    }

    void run(const Monitor& monitor) {
        for (int k = 0; k < mOptions.steps; ++k) {
            monitor.check(); // the steps of one batch may take hours
            advanceAll();
        }
    }

    /// What has happened, and how far the points are from their tracks now.
    Tally<N> tally() {
        const auto potentials = sample();
        Tally<N> sum = mTally;
        for (size_t i = 0; i < static_cast<size_t>(position().size); ++i) {
            sum.outside += !mAllowed[i];
            sum.notConverged += !mConverged[i];
            if (!mConverged[i]) continue;
            for (size_t q = 0; q < potentials.size(); ++q) {
                const double residual = potentials[q].c[0][i] - mTips.track[q][i];
                sum.squares[q] += residual * residual;
            }
        }
        return sum;
    }

    const PointBatchN<N>& position() const { return mTips.position; }
    const VecBatchN<double, N>& velocity() const { return mTips.velocity; }
    TrackBatchN<N>& track() { return mTips.track; }
    std::array<bool, kBatch>& converged() { return mConverged; }
    /// The fraction of the time for which each point moves.
    std::array<double, kBatch>& pace() { return mPace; }

  private:
    using Jets = typename FlowN<N>::template Jets<double>;

    /// The potentials at the points; also sets their velocities, and their distances from the wall.
    Jets sample() {
        Jets potentials;
        mStepper.flow().eval(mTips.position, potentials, mTips.velocity);
        classify(mStepper.flow().domain(), mTips.position, mAllowed, mTips.distance);
        return potentials;
    }

    bool adapts() const { return tableauOf(mOptions.scheme).embedded(); }
    int whole() const { return 1 << mOptions.reprojection.maxSubdivisions; }

    /// What becomes of a step that was tried.
    enum class Outcome : uint8_t {
        reject, ///< The guard does not accept it.
        refine, ///< Longer or less accurate than asked for.
        accept,
        coarsen, ///< So accurate that the next may be twice as long.
    };

    /// One time step of every point. What is left of it is counted in parts of 2^-maxSubdivisions.
    void advanceAll() {
        std::array<size_t, kBatch> active;
        std::array<int, kBatch> left;
        size_t count = 0;
        if (!adapts()) mPart.fill(whole());
        for (size_t i = 0; i < static_cast<size_t>(position().size); ++i) {
            if (mStepper.guardsWalls() && !mAllowed[i]) continue;
            left[i] = whole();
            active[count++] = i;
        }
        const double smallest = mOptions.time / mOptions.steps / whole();
        while (count > 0) {
            ActiveTipsN<N> from;
            std::array<double, kBatch> dt;
            from.position.size = static_cast<int>(count);
            for (size_t a = 0; a < count; ++a) {
                from.copy(static_cast<int>(a), mTips, static_cast<int>(active[a]));
                dt[a] = smallest * mPart[active[a]] * mPace[active[a]];
            }
            const StepResultN<N> to = mStepper(from, dt);
            size_t rest = 0;
            for (size_t a = 0; a < count; ++a)
                if (acceptStep(active[a], from, to, a, left[active[a]])) active[rest++] = active[a];
            count = rest;
        }
    }

    /// Moves point i to the end of step a if that is accepted, and chooses its next step. Returns whether any of the
    /// time is left.
    bool acceptStep(size_t i, const ActiveTipsN<N>& from, const StepResultN<N>& to, size_t a, int& left) {
        int& part = mPart[i];
        const Outcome outcome = outcomeOf(from, to, a);
        mTally.iterations += static_cast<size_t>(to.reprojected.iterations[a]);
        if (outcome == Outcome::reject || (outcome == Outcome::refine && part > 1)) {
            if (part > 1) {
                ++mTally.retries;
                part /= 2;
                return true;
            }
            ++mTally.stalled;
            mConverged[i] = false;
            return false;
        }
        mTips.position.set(static_cast<int>(i), to.position[static_cast<int>(a)]);
        mTips.velocity.set(static_cast<int>(i), to.reprojected.velocity[static_cast<int>(a)]);
        if (mStepper.guardsWalls()) mTips.distance[i] = to.distance[a];
        ++mTally.substeps;
        mTally.coarse += outcome == Outcome::refine;
        left -= part;
        // A part begins at a multiple of its length, so that the whole can be filled.
        if (outcome == Outcome::coarsen && part < whole() && left % (2 * part) == 0) part *= 2;
        return left > 0;
    }

    Outcome outcomeOf(const ActiveTipsN<N>& from, const StepResultN<N>& to, size_t a) const {
        if (!to.accepted[a]) return Outcome::reject;
        const auto i = static_cast<int>(a);
        const bool tooLong = mOptions.maxStep > 0 && length(to.position[i] - from.position[i]) > mOptions.maxStep;
        if (tooLong || to.error[a] > mOptions.accuracy) return Outcome::refine;
        if (!adapts()) return Outcome::accept;
        constexpr double kSafety = 2;
        const int twiceAsLong = 1 << tableauOf(mOptions.scheme).errorOrder; // by which the error grows
        return to.error[a] * twiceAsLong * kSafety < mOptions.accuracy ? Outcome::coarsen : Outcome::accept;
    }

    const GuardedStepper<N>& mStepper;
    const AdvectOptions& mOptions;
    ActiveTipsN<N> mTips;
    std::array<bool, kBatch> mAllowed, mConverged;
    std::array<int, kBatch> mPart; ///< How long each point's next step is.
    std::array<double, kBatch> mPace;
    Tally<N> mTally;
};

} // namespace curlew::detail
