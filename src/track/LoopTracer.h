// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "Closure.h"

#include <vector>

namespace curlew {

/// What all tracks of a loop have in common.
struct LoopSetup {
    GuardedStepper<3> stepper; ///< By time.
    double longest;            ///< Of steps, seconds.
    double firstChord;         ///< The first step of a track is shorter, world units.
    double accuracy;           ///< The most that the estimated error of a step may be, world units.
    size_t vertices;           ///< Most per track.
};

/// A moment on a track. In single precision, what interpolation multiplies with the length of a step.
struct LoopVertex {
    Vec3d position;
    double time;                  ///< From the seed, seconds; negative before it.
    Vec3f velocity, acceleration; ///< Of a particle that follows the flow.
};

/// The part of a track that leads from its seed in one direction.
struct LoopLine {
    std::vector<LoopVertex> vertices; ///< The seed first; a closed one has it at its end again, one period later.
    CurveEnd end = CurveEnd::outside;
    double gap = 0;    ///< Of a closed one, world units.
    size_t coarse = 0; ///< Steps beyond the accuracy that could not be shorter.
};

/// Follows up to kBatch tracks at once in one direction, +1 along the flow, -1 against it, with steps whose lengths
/// are powers of two parts of the longest.
class LoopTracer {
  public:
    LoopTracer(const LoopSetup& setup, double sign, std::vector<LoopLine>& lines)
        : mSetup(setup), mSign(sign), mLines(lines) {}

    /// Begins a line at a seed; it is followed for `limit` seconds, or until it closes if it may.
    void add(size_t line, const ActiveTipsN<3>& seeds, int seed, double limit, bool closes);
    /// Follows all lines to their ends. Accelerations are left out.
    void run(const Monitor& monitor);

  private:
    static constexpr int kWhole = 1 << 24;
    /// Which line a tip extends, and what it needs to know of it.
    struct Growth {
        size_t line;
        int part;
        double limit;
        bool closes;
        Origin origin;
    };

    double timeLeft(const Growth& growth) const { return growth.limit - std::abs(last(growth).time); }
    double stepOf(int part) const { return mSetup.longest * part / kWhole; }
    const LoopVertex& last(const Growth& growth) const { return mLines[growth.line].vertices.back(); }
    void advance();
    /// Takes step i, of length dt, or makes the next one shorter. Returns whether the line goes on.
    bool proceed(Growth& growth, int i, const StepResultN<3>& step, double dt);
    bool tooCoarse(int i, const StepResultN<3>& step) const;

    const LoopSetup& mSetup;
    double mSign;
    std::vector<LoopLine>& mLines;
    ActiveTipsN<3> mTips;
    std::vector<Growth> mGrowths; ///< One for each tip.
};

/// The vertex at a position with this velocity.
LoopVertex loopVertex(const Vec3d& position, const Vec3d& velocity, double time);

} // namespace curlew
