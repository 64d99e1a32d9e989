// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "BatchAdvector.h"
#include "curlew/track/Splitting.h"

namespace curlew::detail {

/// A sum as a composition of the flows of its terms: the state that all batches share.
template <int N>
class SplitStepper {
  public:
    /// `rms`: scales of each term by itself.
    SplitStepper(const FlowN<N>& flow, const std::vector<FlowRmsN<N>>& rms, Splitting splitting,
                 const AdvectOptions& options)
        : mFlow(flow), mOptions(options), mOrder(splitting == Splitting::yoshida ? 4 : 2), mRms(rms) {
        for (size_t k = 0; k < flow.terms().size(); ++k)
            mTerms.push_back(advectionStepper(FlowN<N>(flow.terms()[k], flow.domain()), options,
                                              inUnitsOf(rms[k], options.reprojection)));
        for (const SplitFactor& factor : compositionOf(splitting, mTerms.size())) {
            AdvectOptions one = options;
            one.steps = 1;
            one.scheme = options.usedScheme();
            one.accuracy = 0;
            one.time = stepTime() * factor.fraction;
            mFactors.push_back({factor.term, one});
        }
    }

    const FlowN<N>& flow() const { return mFlow; }
    const AdvectOptions& options() const { return mOptions; }
    int steps() const { return mOptions.steps > 0 ? mOptions.steps : kMoments; }
    double stepTime() const { return mOptions.time / steps(); }
    int order() const { return mOrder; }

    /// Moves points through the factors of one step, each for its `pace`, a fraction of the step. Writes to `converged`
    /// whether no factor left a point in place. Adds to the tally, with drifts relative to the potentials' root mean
    /// squares.
    void operator()(PointBatchN<N>& points, const std::array<double, kBatch>& pace, std::array<bool, kBatch>& converged,
                    Tally<N>& tally, const Monitor& monitor) const {
        converged.fill(true);
        for (const Factor& factor : mFactors) {
            BatchAdvector<N> batch(mTerms[factor.term], factor.options, 0, {points});
            auto& part = batch.parts().front();
            part.pace = pace;
            batch.run(monitor);
            points = part.tips.position;
            for (size_t i = 0; i < converged.size(); ++i) converged[i] = converged[i] && part.converged[i];
            Tally<N> counts = batch.counts();
            for (size_t q = 0; q < counts.drift.size(); ++q)
                if (const double rms = mRms[factor.term].potentials[q]; rms > 0) counts.drift[q] /= rms;
            tally += counts;
        }
    }

    /// Returns the distances between the ends of a step and those of a Runge-Kutta step of the whole sum, whose error
    /// has a higher order than Strang's and the same order as the triple jump's.
    std::array<double, kBatch> error(const PointBatchN<N>& from, const std::array<double, kBatch>& pace,
                                     const PointBatchN<N>& to) const {
        std::array<double, kBatch> dt, error{};
        for (size_t i = 0; i < dt.size(); ++i) dt[i] = stepTime() * pace[i];
        const auto velocity = [&](const PointBatchN<N>& p, VecBatchN<double, N>& v) { mFlow.velocity(p, v); };
        StagesN<N> stages;
        PointBatchN<N> whole;
        velocity(from, stages[0]);
        step(Scheme::rk4, from, dt, velocity, stages, whole);
        for (int i = 0; i < from.size; ++i) error[static_cast<size_t>(i)] = length(whole[i] - to[i]);
        return error;
    }

  private:
    struct Factor {
        size_t term;
        AdvectOptions options; ///< One step of the factor's duration.
    };
    FlowN<N> mFlow;
    AdvectOptions mOptions;
    int mOrder;
    std::vector<FlowRmsN<N>> mRms;
    std::vector<GuardedStepper<N>> mTerms;
    std::vector<Factor> mFactors;
};

/// Moves the points of one batch through all steps of a sum. With an accuracy, the steps of the composition are
/// adaptive too, separately for each point: a step is divided into units of 2^-maxSubdivisions.
template <int N>
class SplitAdvector {
  public:
    using Part = typename BatchAdvector<N>::Part;

    SplitAdvector(const SplitStepper<N>& stepper, const PointBatchN<N>& points)
        : mStepper(stepper), mAdapts(stepper.options().adaptive()) {
        mPart.tips.position = points;
        mPart.converged.fill(true);
        mPart.error.fill(0);
        mPart.pace.fill(1);
        mFraction.fill(whole());
    }

    /// The points. They have no tracks, and velocities only after tally().
    Part& part() { return mPart; }

    void run(const Monitor& monitor) {
        for (int k = 0; k < mStepper.steps(); ++k) advanceAll(monitor);
    }

    Tally<N> tally() {
        mStepper.flow().velocity(mPart.tips.position, mPart.tips.velocity);
        classify(mStepper.flow().domain(), mPart.tips.position, mPart.allowed, mPart.tips.distance);
        Tally<N> sum = mTally;
        for (size_t i = 0; i < mPart.size(); ++i) {
            sum.outside += !mPart.allowed[i];
            sum.notConverged += !mPart.converged[i];
            sum.error += mPart.error[i];
            sum.maxError = std::max(sum.maxError, mPart.error[i]);
        }
        return sum;
    }

  private:
    int whole() const { return 1 << mStepper.options().reprojection.maxSubdivisions; }

    /// Takes one time step of every point. The rest of each step is counted in units of 2^-maxSubdivisions.
    void advanceAll(const Monitor& monitor) {
        std::array<size_t, kBatch> active;
        std::array<int, kBatch> left;
        left.fill(whole());
        for (size_t i = 0; i < active.size(); ++i) active[i] = i;
        for (size_t count = mPart.size(); count > 0;) {
            PointBatchN<N> from;
            std::array<double, kBatch> pace{}, error{};
            for (size_t a = 0; a < count; ++a) {
                from.push(mPart.tips.position[static_cast<int>(active[a])]);
                pace[a] = mPart.pace[active[a]] * mFraction[active[a]] / whole();
            }
            PointBatchN<N> to = from;
            std::array<bool, kBatch> converged;
            mStepper(to, pace, converged, mTally, monitor);
            if (mAdapts) error = mStepper.error(from, pace, to);
            size_t rest = 0;
            for (size_t a = 0; a < count; ++a)
                if (accept(active[a], to[static_cast<int>(a)], converged[a], error[a], left[active[a]]))
                    active[rest++] = active[a];
            count = rest;
        }
    }

    /// Moves point i to the end of its step if the step is accurate enough. Returns whether any time remains.
    bool accept(size_t i, const Vec<double, N>& end, bool converged, double error, int& left) {
        const double accuracy = mStepper.options().accuracy;
        const bool refine = mAdapts && !(error <= accuracy);
        int& fraction = mFraction[i];
        if (refine && fraction > 1) {
            ++mTally.retries;
            fraction /= 2;
            return true;
        }
        mTally.coarse += refine;
        mPart.tips.position.set(static_cast<int>(i), end);
        mPart.converged[i] = mPart.converged[i] && converged;
        mPart.error[i] += error;
        left -= fraction;
        constexpr double kSafety = 2;
        const int twiceAsLong = 2 << mStepper.order(); // factor by which the error of a step grows
        // A part must begin at a multiple of its length, so that parts fill the whole step.
        if (error * twiceAsLong * kSafety < accuracy && fraction < whole() && left % (2 * fraction) == 0) fraction *= 2;
        return left > 0;
    }

    const SplitStepper<N>& mStepper;
    bool mAdapts;
    Part mPart;
    std::array<int, kBatch> mFraction; ///< Length of each point's next step.
    Tally<N> mTally;
};

} // namespace curlew::detail
