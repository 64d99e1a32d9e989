#pragma once

#include "curlew/track/Trace.h"

#include <optional>
#include <utility>

namespace curlew {

/// What all curves have in common, with the defaults filled in.
struct TraceSetup {
    Flow flow, pace; ///< The flow, and the one of which dt is what the steps are equal in.
    TraceOptions options;
    FlowMagnitudes typical;
    ReprojectOptions reprojection;
    double cosTurn, cosHalfTurn; ///< Of the most that a step may turn, and half of that.

    Vec3d paced(const Vec3d& velocity) const {
        if (options.by == StepBy::time) return velocity;
        const double speed = length(velocity);
        return speed > 0 ? velocity * (1 / speed) : velocity;
    }
    bool stands(const Vec3d& velocity) const {
        const double speed = length(velocity);
        return !(speed > 0) || !(speed >= options.stagnation * typical.speed);
    }
};

/// The ends, so far, of curves, side by side.
struct TraceHeads {
    PointBatch position;
    VecBatch<double> velocity;
    TrackBatch track;
    std::array<double, kBatch> distance;

    void copy(int to, const TraceHeads& from, int i) {
        position.set(to, from.position[i]);
        velocity.set(to, from.velocity[i]);
        for (size_t q = 0; q < track.size(); ++q)
            track[q][static_cast<size_t>(to)] = from.track[q][static_cast<size_t>(i)];
        distance[static_cast<size_t>(to)] = from.distance[static_cast<size_t>(i)];
    }
    TraceHeads only(int i) const {
        TraceHeads one;
        one.position.size = 1;
        one.copy(0, *this, i);
        return one;
    }
};

struct TraceLanding;

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

/// Curves on their way in one direction: +1 along the flow or -1 against it. At most kBatch of them.
class Tracer {
  public:
    Tracer(const TraceSetup& setup, double sign, std::vector<TraceLine>& lines)
        : mSetup(setup), mSign(sign), mLines(lines) {}

    /// Begins a line at the head of a seed.
    void add(size_t line, const TraceHeads& seeds, int seed);

    /// Follows all lines to their ends; how many steps were redone.
    size_t run(const Monitor& monitor);

  private:
    struct Lane {
        size_t line;
        int part; ///< Of a step, in units of 2^-halvings.
        Vec3d seed, normal;
    };

    int whole() const { return 1 << mSetup.options.halvings; }
    TraceVertex& last(const Lane& lane) { return mLines[lane.line].vertices.back(); }

    /// A step of every line, or a part of one.
    void advance();
    /// Whether step i turns by more than an angle of this cosine.
    bool turns(const TraceLanding& landing, int i, double cosine) const;
    /// Adds the end of a step to its line, which ends there if a reason is returned.
    std::optional<CurveEnd> settle(const Lane& lane, int i, const TraceLanding& landing, double dt);
    /// Adds point k of a landing, where a step from head i has led.
    void push(const Lane& lane, int i, const TraceLanding& landing, int k, double dt);
    /// The step from head i that ends on a plane, no longer than dt; none where there is no such.
    std::optional<std::pair<TraceLanding, double>> landOn(int i, const Vec3d& point, const Vec3d& normal, double chord,
                                                          double dt) const;
    /// Whether the line comes back to its seed with this step; then closes it.
    bool closes(const Lane& lane, int i, const TraceLanding& landing, double dt);
    /// Takes the line to the face of the box that the step goes through first.
    void leave(const Lane& lane, int i, const TraceLanding& landing, double dt);

    const TraceSetup& mSetup;
    double mSign;
    std::vector<TraceLine>& mLines;
    TraceHeads mHeads;
    std::vector<Lane> mLanes;
    size_t mRetries = 0;
};

} // namespace curlew
