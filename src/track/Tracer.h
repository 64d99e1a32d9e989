// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "Closure.h"
#include "curlew/track/Trace.h"

#include <optional>

namespace curlew {

/// The parameters that all curves share, with defaults filled in.
struct TraceSetup {
    GuardedStepper<3> stepper;
    TraceOptions options;
    FlowRms rms;
    double cosTurn, cosHalfTurn; ///< Cosines of the maximum turn of a step and of half of it.

    bool stagnates(const Vec3d& velocity) const {
        const double speed = length(velocity);
        return !(speed > 0) || !(speed >= options.stagnation * rms.speed);
    }
};

struct TraceVertex {
    Vec3d position, velocity;
    std::array<double, 2> potentials;
    double along;
};

/// The part of a curve in one direction from its seed.
struct TraceLine {
    std::vector<TraceVertex> vertices; ///< Starts with the seed.
    CurveEnd end = CurveEnd::outside;
    double gap = 0;
};

using StepResult = StepResultN<3>;

/// Follows up to kBatch curves at once in one direction: +1 along the flow, -1 against it.
class Tracer {
  public:
    Tracer(const TraceSetup& setup, double sign, std::vector<TraceLine>& lines)
        : mSetup(setup), mSign(sign), mLines(lines) {}

    /// Starts a line at a seed.
    void add(size_t line, const ActiveTipsN<3>& seeds, int seed);

    /// Follows all lines to their ends. Returns the number of halved steps.
    size_t run(const Monitor& monitor);

  private:
    /// The line that a tip extends, and the length of its next step.
    struct TipState {
        size_t line;
        int part; ///< Length of its next step, in units of 2^-maxSubdivisions steps.
        Origin origin;
    };

    int whole() const { return 1 << mSetup.options.reprojection.maxSubdivisions; }
    TraceVertex& last(const TipState& tip) { return mLines[tip.line].vertices.back(); }

    /// Takes a step, or a part of one, of every line.
    void advance();
    /// Returns whether step i turns by more than the angle of this cosine.
    bool turns(const StepResult& step, int i, double cosine) const;
    /// Adds the end of step i to its line. Returns the reason if the line ends there.
    std::optional<CurveEnd> acceptStep(const TipState& tip, int i, const StepResult& step, double dt);
    /// Adds the end k of a step that began at tip i.
    void push(const TipState& tip, int i, const StepResult& step, int k, double dt);
    /// Closes the line if it returns to its seed in this step. Returns whether it does.
    bool closes(const TipState& tip, int i, const StepResult& step, double dt);
    /// Ends the line on the first face of the box that the step crosses.
    void leave(const TipState& tip, int i, const StepResult& step, double dt);

    const TraceSetup& mSetup;
    double mSign;
    std::vector<TraceLine>& mLines;
    ActiveTipsN<3> mTips;
    std::vector<TipState> mTipStates; ///< One per tip.
    size_t mRetries = 0;
};

} // namespace curlew
