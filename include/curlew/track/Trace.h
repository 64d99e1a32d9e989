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
    double step = 0;  ///< World units or seconds; 0: 1/200 of the box's diagonal, for `time` at the flow's rms speed.
    double limit = 0; ///< Maximum in each direction, world units or seconds; 0: 1600 default steps, 8 diagonals.
    size_t vertices = 100000; ///< Maximum in each direction.
    Direction direction = Direction::forward;
    double turn = 0.25; ///< A step that turns by more than this angle, radians, is halved.
    /// A step whose estimated error along the track is larger than this, world units, is halved. 0: defaultAccuracy()
    /// if steps are equal in time; no bound if they are equal in length, because the error then only affects where the
    /// vertices lie on the track.
    double accuracy = 0;
    double stagnation = 1e-3; ///< A curve ends where the flow is slower than this, relative to its rms speed.
    /// A curve that passes its seed within this distance, relative to the step, is closed; 0: no curve is closed.
    double closure = 1e-3;
    ReprojectionOptions reprojection = {.tolerance = 1e-9};
};

struct TraceResult {
    Curves curves;                         ///< One per seed, in the order of the seeds.
    std::array<size_t, kCurveEnds> ends{}; ///< Number of ends of each kind; a closed curve counts once.
    double gapRms = 0, gapMax = 0;         ///< Gaps of the closed curves, world units.
    /// |f - f at the seed| over all vertices, relative to f's rms; likewise for g.
    std::array<double, 2> driftRms{}, driftMax{};
    double lengthMean = 0, lengthMax = 0; ///< World units.
    size_t retries = 0;                   ///< Steps that were halved and redone.

    size_t count(CurveEnd end) const { return ends[static_cast<size_t>(end)]; }
};

/// Traces streamlines from the positions of the seeds in steps of equal length (RK4, or rk45 if `accuracy` is given) or
/// equal time (rk45; a vertex is then where a particle is at that time). Each step is reprojected onto the track of the
/// seed (ICN Algorithm 1). Streamlines of a flow in a bounded domain are often closed. A curve is closed if it passes
/// near its seed where it crosses the plane through the seed that is normal to the velocity there; the polyline is then
/// closed at the seed itself.
///
/// No curve crosses a wall. A step is checked as in advect(); it must also end at a finite position, and its correction
/// must be at most half its length. If `maxSubdivisions` halvings do not suffice, the curve ends. Steps are also
/// shortened where the curve bends (`turn`), at the limit and at the faces of the domain's box. Walls are respected
/// without reprojection too, which must be off for a flow without tracks, but then f and g drift.
///
/// No curve influences another, so the result does not depend on the number of threads. Seeds that are beyond the wall,
/// outside the box or not finite give empty curves. Throws ValueError if an option is not positive or not finite, the
/// domain is infinite, or reprojection is requested in a flow without tracks; ResourceError if the curves do not fit
/// into memory; Interrupted.
TraceResult trace(const Flow& flow, const Points& seeds, const TraceOptions& options = {}, const Monitor& monitor = {});

} // namespace curlew
