// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/track/Curves.h"
#include "curlew/track/Points.h"
#include "curlew/track/Reproject.h"

namespace curlew {

enum class Direction { forward, backward, both };
inline constexpr std::array<std::string_view, 3> kDirectionNames{"forward", "backward", "both"};

struct TraceOptions {
    StepBy by = StepBy::length;
    double step = 0;          ///< World units or seconds; 0: a 200th of the box's diagonal, at the flow's rms speed.
    double limit = 0;         ///< In each direction, world units or seconds; 0: 1600 default steps, 8 diagonals.
    size_t vertices = 100000; ///< Most in each direction.
    Direction direction = Direction::forward;
    double turn = 0.25; ///< A step that turns by more, radians, is halved.
    /// A step whose estimated error along the track is larger is halved, world units. 0: if steps are equal in time,
    /// defaultAccuracy(); if they are equal in length, which only places the vertices, none is asked for.
    double accuracy = 0;
    double stagnation = 1e-3; ///< Where the flow is slower than this, relative to its rms speed, a curve ends.
    /// A curve that passes its seed nearer than this, relative to the step, is closed; 0: none is.
    double closure = 1e-3;
    ReprojectionOptions reprojection = {.tolerance = 1e-9};
};

struct TraceResult {
    Curves curves;                                ///< One for each seed, in the order of the seeds.
    std::array<size_t, kCurveEnds> ends{};        ///< How many ends there are of each kind; a closed curve counts once.
    double gapRms = 0, gapMax = 0;                ///< Of the closed curves, world units.
    std::array<double, 2> driftRms{}, driftMax{}; ///< |f - f at the seed| over all vertices, relative to f's rms; of g.
    double lengthMean = 0, lengthMax = 0;         ///< World units.
    size_t retries = 0;                           ///< Steps that were redone in halves.

    size_t count(CurveEnd end) const { return ends[static_cast<size_t>(end)]; }
};

/// Streamlines from the positions of the seeds, by steps of equal length (RK4) or time (rk45, so that vertices are
/// where a particle is at that time), each put back onto the track that the seed is on (ICN Algorithm 1). Streamlines
/// of a flow in a bounded domain are often closed: that is detected where a curve passes the plane through its seed
/// across the velocity there, and the polyline is closed at the seed itself.
///
/// No curve goes through a wall: a step is judged as in advect(), and has to end at a finite position after a
/// correction of at most half its length. If `maxSubdivisions` do not help, the curve ends. A step is also shorter
/// where the curve bends (`turn`), at the limit and at the face of the domain's box. Walls are respected without
/// reprojection, too, which a flow without tracks requires, but then f and g drift.
///
/// Each curve is its own: the result does not depend on the other seeds, nor on the number of threads. Seeds beyond the
/// wall, outside the box or not finite give empty curves. Throws ValueError for options that are not positive or not
/// finite, for an infinite domain, and for reprojection in a flow without tracks; ResourceError where the memory would
/// not do; Interrupted.
TraceResult trace(const Flow& flow, const Points& seeds, const TraceOptions& options = {}, const Monitor& monitor = {});

} // namespace curlew
