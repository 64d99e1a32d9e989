// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "Closure.h"

#include <vector>

namespace curlew {

/// The parameters that all tracks of a loop share.
struct LoopSetup {
    GuardedStepper<3> stepper; ///< Steps by time.
    double maxStep;            ///< Maximum step, seconds.
    double firstChord;         ///< Upper bound on the first step of a track, world units.
    double accuracy;           ///< Upper bound on the estimated error of a step, world units.
    size_t vertices;           ///< Maximum per track.
};

/// A tabulated point of a track. The members that interpolation multiplies by a step length are in single precision.
struct LoopVertex {
    Vec3d position;
    double time;                  ///< Seconds from the seed; negative before it.
    Vec3f velocity, acceleration; ///< Those of a particle that follows the flow.
};

/// The part of a track in one direction from its seed.
struct LoopLine {
    std::vector<LoopVertex> vertices; ///< Starts with the seed; a closed track ends with it too, one period later.
    CurveEnd end = CurveEnd::outside;
    double gap = 0;    ///< If closed, world units.
    size_t coarse = 0; ///< Steps that exceed the accuracy but could not be shortened.
};

/// Follows up to kBatch tracks at once in one direction, +1 along the flow, -1 against it. Step lengths are the maximum
/// step divided by powers of two.
class LoopTracer {
  public:
    LoopTracer(const LoopSetup& setup, double sign, std::vector<LoopLine>& lines)
        : mSetup(setup), mSign(sign), mLines(lines) {}

    /// Starts a line at a seed. The line is followed for `limit` seconds, or until it closes if `closes` is set.
    void add(size_t line, const ActiveTipsN<3>& seeds, int seed, double limit, bool closes);
    /// Follows all lines to their ends. Does not set accelerations.
    void run(const Monitor& monitor);

  private:
    static constexpr int kWhole = 1 << 24;
    /// The line that a tip extends, and the length of its next step.
    struct TipState {
        size_t line;
        int part;
        double limit;
        bool closes;
        Origin origin;
    };

    double timeLeft(const TipState& tip) const { return tip.limit - std::abs(last(tip).time); }
    double stepOf(int part) const { return mSetup.maxStep * part / kWhole; }
    const LoopVertex& last(const TipState& tip) const { return mLines[tip.line].vertices.back(); }
    void advance();
    /// Accepts step i, of length dt, or shortens the next try. Returns whether the line continues.
    bool proceed(TipState& tip, int i, const StepResultN<3>& step, double dt);
    bool tooCoarse(int i, const StepResultN<3>& step) const;

    const LoopSetup& mSetup;
    double mSign;
    std::vector<LoopLine>& mLines;
    ActiveTipsN<3> mTips;
    std::vector<TipState> mTipStates; ///< One per tip.
};

/// Returns the vertex at a position with this velocity.
LoopVertex loopVertex(const Vec3d& position, const Vec3d& velocity, double time);

} // namespace curlew
