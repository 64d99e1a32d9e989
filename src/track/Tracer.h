// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "Closure.h"
#include "curlew/track/Trace.h"

#include <optional>

namespace curlew {

/// What all curves have in common, with the defaults filled in.
struct TraceSetup {
    GuardedStepper<3> stepper;
    TraceOptions options;
    FlowMagnitudes typical;
    double cosTurn, cosHalfTurn; ///< Of the most that a step may turn, and half of that.

    bool stands(const Vec3d& velocity) const {
        const double speed = length(velocity);
        return !(speed > 0) || !(speed >= options.stagnation * typical.speed);
    }
};

struct TraceVertex {
    Vec3d position, velocity;
    std::array<double, 2> potentials;
    double along;
};

/// The part of a curve that leads from its seed in one direction.
struct TraceLine {
    std::vector<TraceVertex> vertices; ///< The seed first.
    CurveEnd end = CurveEnd::outside;
    double gap = 0;
};

using StepResult = StepResultN<3>;

/// Follows up to kBatch curves at once in one direction: +1 along the flow, -1 against it.
class Tracer {
  public:
    Tracer(const TraceSetup& setup, double sign, std::vector<TraceLine>& lines)
        : mSetup(setup), mSign(sign), mLines(lines) {}

    /// Begins a line at a seed.
    void add(size_t line, const ActiveTipsN<3>& seeds, int seed);

    /// Follows all lines to their ends. Returns how many steps were halved.
    size_t run(const Monitor& monitor);

  private:
    /// Which line a tip extends, and what it needs to know of it.
    struct Growth {
        size_t line;
        int part; ///< Of a step, in units of 2^-maxSubdivisions.
        Origin origin;
    };

    int whole() const { return 1 << mSetup.options.reprojection.maxSubdivisions; }
    TraceVertex& last(const Growth& growth) { return mLines[growth.line].vertices.back(); }

    /// Takes a step of every line, or a part of one.
    void advance();
    /// Whether step i turns by more than an angle of this cosine.
    bool turns(const StepResult& step, int i, double cosine) const;
    /// Adds the end of step i to its line. Returns why the line ends there, if it does.
    std::optional<CurveEnd> acceptStep(const Growth& growth, int i, const StepResult& step, double dt);
    /// Adds the end k of a step that began at tip i.
    void push(const Growth& growth, int i, const StepResult& step, int k, double dt);
    /// Whether the line returns to its seed with this step; if so, closes it.
    bool closes(const Growth& growth, int i, const StepResult& step, double dt);
    /// Ends the line on the face of the box that the step passes first.
    void leave(const Growth& growth, int i, const StepResult& step, double dt);

    const TraceSetup& mSetup;
    double mSign;
    std::vector<TraceLine>& mLines;
    ActiveTipsN<3> mTips;
    std::vector<Growth> mGrowths; ///< One for each tip.
    size_t mRetries = 0;
};

} // namespace curlew
