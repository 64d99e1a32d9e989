#pragma once

#include "ChordRule.h"
#include "curlew/track/Advect.h"

#include <cstdint>

namespace curlew::detail {

/// What one batch contributes to AdvectResult.
template <int N>
struct Tally {
    size_t notConverged = 0, keptBack = 0, outside = 0, substeps = 0, retries = 0, coarse = 0, iterations = 0;
    std::array<double, FlowN<N>::kPotentials> squares{}; // of the residuals

    Tally& operator+=(const Tally& o) {
        notConverged += o.notConverged;
        keptBack += o.keptBack;
        outside += o.outside;
        substeps += o.substeps;
        retries += o.retries;
        coarse += o.coarse;
        iterations += o.iterations;
        for (size_t q = 0; q < squares.size(); ++q) squares[q] += o.squares[q];
        return *this;
    }
};

/// The points of one batch on their way through all steps.
template <int N>
class BatchAdvector {
  public:
    /// The points, each on the track that it begins on.
    BatchAdvector(const FlowN<N>& flow, const AdvectOptions& options, const ReprojectOptionsN<N>& reprojection,
                  const PointBatchN<N>& points)
        : mFlow(flow), mOptions(options), mReprojection(reprojection), mPosition(points) {
        const auto potentials = look();
        for (size_t q = 0; q < mTrack.size(); ++q) mTrack[q] = potentials[q].c[0];
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
        const auto potentials = look();
        Tally<N> sum = mTally;
        for (size_t i = 0; i < static_cast<size_t>(mPosition.size); ++i) {
            sum.outside += !mAllowed[i];
            sum.notConverged += !mConverged[i];
            if (!mConverged[i]) continue;
            for (size_t q = 0; q < potentials.size(); ++q) {
                const double residual = potentials[q].c[0][i] - mTrack[q][i];
                sum.squares[q] += residual * residual;
            }
        }
        return sum;
    }

    const PointBatchN<N>& position() const { return mPosition; }
    const VecBatchN<double, N>& velocity() const { return mVelocity; }
    TrackBatchN<N>& track() { return mTrack; }
    std::array<bool, kBatch>& converged() { return mConverged; }
    /// What part of the time each point moves.
    std::array<double, kBatch>& pace() { return mPace; }

  private:
    using Jets = typename FlowN<N>::template Jets<double>;

    bool reprojects() const { return mOptions.reprojection != Reprojection::none; }

    /// The potentials where the points are; also their velocities, and where they are of the wall.
    Jets look() {
        Jets potentials;
        mFlow.eval(mPosition, potentials, mVelocity);
        classify(mFlow.domain(), mPosition, mAllowed, mDistance);
        return potentials;
    }

    bool adapts() const { return mOptions.scheme == Scheme::bogackiShampine; }
    int whole() const { return 1 << mOptions.halvings; }

    /// What became of a step that was tried.
    enum class Outcome : uint8_t {
        failed, ///< Off its track, or across a wall.
        rough,  ///< Longer or less accurate than asked for.
        taken,
        calm, ///< So accurate that the next may be twice as long.
    };
    using Outcomes = std::array<Outcome, kBatch>;

    /// One time step of every point. What is left of it is counted in parts of 2^-halvings.
    void advanceAll() {
        std::array<size_t, kBatch> active;
        std::array<int, kBatch> left;
        size_t count = 0;
        if (!adapts()) mPart.fill(whole());
        for (size_t i = 0; i < static_cast<size_t>(mPosition.size); ++i) {
            if (reprojects() && !mAllowed[i]) continue;
            left[i] = whole();
            active[count++] = i;
        }
        const double smallest = mOptions.time / mOptions.steps / whole();
        while (count > 0) {
            std::array<double, kBatch> dt;
            for (size_t a = 0; a < count; ++a) dt[a] = smallest * mPart[active[a]] * mPace[active[a]];
            const Outcomes outcomes = tryStep(active, count, dt);
            size_t rest = 0;
            for (size_t a = 0; a < count; ++a)
                if (settle(active[a], outcomes[a], left[active[a]])) active[rest++] = active[a];
            count = rest;
        }
    }

    /// Counts a step of one point, and chooses its next. Returns whether any of the time is left.
    bool settle(size_t i, Outcome outcome, int& left) {
        int& part = mPart[i];
        if (outcome == Outcome::failed || (outcome == Outcome::rough && part > 1)) {
            if (part > 1) {
                ++mTally.retries;
                part /= 2;
                return true;
            }
            ++mTally.keptBack;
            mConverged[i] = false;
            return false;
        }
        ++mTally.substeps;
        mTally.coarse += outcome == Outcome::rough;
        left -= part;
        // A part begins at a multiple of its length, so that the whole can be filled.
        if (outcome == Outcome::calm && part < whole() && left % (2 * part) == 0) part *= 2;
        return left > 0;
    }

    /// Tries a step for the particles listed in `active`; keeps those that succeed, or cannot be made any shorter.
    Outcomes tryStep(const std::array<size_t, kBatch>& active, size_t count, const std::array<double, kBatch>& dt) {
        PointBatchN<N> from, to;
        StagesN<N> stages;
        TrackBatchN<N> track;
        for (size_t a = 0; a < count; ++a) {
            const int i = static_cast<int>(active[a]);
            stages.first.set(static_cast<int>(a), mVelocity[i]);
            from.push(mPosition[i]);
            for (size_t q = 0; q < track.size(); ++q) track[q][a] = mTrack[q][active[a]];
        }
        step(
            mOptions.scheme, from, dt, [&](const PointBatchN<N>& p, VecBatchN<double, N>& v) { mFlow.velocity(p, v); },
            stages, to);
        std::array<double, kBatch> limit;
        for (size_t a = 0; a < count; ++a) limit[a] = length(to[static_cast<int>(a)] - from[static_cast<int>(a)]);
        ReprojectedBatchN<N> landed;
        reproject(mFlow, to, track, limit, mReprojection, landed);

        std::array<bool, kBatch> allowed, taken;
        std::array<double, kBatch> before, distance;
        taken.fill(true);
        if (reprojects()) {
            classify(mFlow.domain(), to, allowed, distance);
            for (size_t a = 0; a < count; ++a) {
                before[a] = mDistance[active[a]];
                taken[a] = landed.converged[a] && allowed[a] && (distance[a] < 0) == (before[a] < 0);
                mTally.iterations += static_cast<size_t>(landed.iterations[a]);
            }
            checkChords(mFlow.domain(), from, to, before, taken);
        }
        const Outcomes outcomes = judge(from, to, stages, landed.velocity, dt, taken);
        for (size_t a = 0; a < count; ++a) {
            if (outcomes[a] == Outcome::failed || (outcomes[a] == Outcome::rough && mPart[active[a]] > 1)) continue;
            const int i = static_cast<int>(active[a]);
            mPosition.set(i, to[static_cast<int>(a)]);
            mVelocity.set(i, landed.velocity[static_cast<int>(a)]);
            if (reprojects()) mDistance[active[a]] = distance[a];
        }
        return outcomes;
    }

    /// Of steps that did not fail: whether they are as short and as accurate as asked for.
    Outcomes judge(const PointBatchN<N>& from, const PointBatchN<N>& to, const StagesN<N>& stages,
                   const VecBatchN<double, N>& last, const std::array<double, kBatch>& dt,
                   const std::array<bool, kBatch>& taken) const {
        std::array<double, kBatch> error{};
        // The velocity where reprojection has ended differs from that where the step has by less than the estimate.
        if (adapts()) error = estimatedError(from.size, stages, last, dt);
        Outcomes outcomes;
        for (int a = 0; a < from.size; ++a) {
            const auto n = static_cast<size_t>(a);
            const bool tooLong = mOptions.longest > 0 && length(to[a] - from[a]) > mOptions.longest;
            constexpr double kTwiceAsLong = 8, kSafety = 2; // a third-order error grows by 2³
            const bool calm = adapts() && error[n] * kTwiceAsLong * kSafety < mOptions.accuracy;
            outcomes[n] = !taken[n]                                 ? Outcome::failed
                          : tooLong || error[n] > mOptions.accuracy ? Outcome::rough
                          : calm                                    ? Outcome::calm
                                                                    : Outcome::taken;
        }
        return outcomes;
    }

    const FlowN<N>& mFlow;
    const AdvectOptions& mOptions;
    const ReprojectOptionsN<N>& mReprojection;
    PointBatchN<N> mPosition;
    VecBatchN<double, N> mVelocity;
    TrackBatchN<N> mTrack;
    std::array<double, kBatch> mDistance;
    std::array<bool, kBatch> mAllowed, mConverged;
    std::array<int, kBatch> mPart; ///< How long each point's next step is.
    std::array<double, kBatch> mPace;
    Tally<N> mTally;
};

} // namespace curlew::detail
