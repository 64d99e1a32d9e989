// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Flow.h"
#include "curlew/track/Points.h"
#include "curlew/track/Reproject.h"

namespace curlew {

struct LoopOptions {
    double duration = 2; ///< Seconds after which every particle is back where it began.
    /// The estimated error of a step along a track, world units; 0: a millionth of the diagonal of the domain's box.
    double accuracy = 0;
    size_t vertices = 4000; ///< Most per track; a track that needs more ends there, and its particle fades earlier.
    ReprojectionOptions reprojection = {};
};

/// What particles do during a loop.
enum class LoopKind : uint8_t {
    closed, ///< It runs round its track a whole number of times.
    fading, ///< Its track takes longer than the loop, or does not close: it fades in and out, and begins anew.
    still   ///< It stays where it is: beyond the wall, at no finite position, or where the flow is zero.
};

struct LoopSummary {
    size_t points = 0, closed = 0, fading = 0, still = 0;
    size_t outside = 0;   ///< Of the still ones: beyond the wall, or on it.
    size_t vertices = 0;  ///< Of all tracks.
    size_t bytes = 0;     ///< Memory of all tracks.
    size_t coarse = 0;    ///< Steps beyond `accuracy` that could not be shorter.
    size_t stuck = 0;     ///< Of the fading ones: tracks on which no step was possible any more.
    size_t truncated = 0; ///< Of the fading ones: tracks with too many vertices.
    double paceMean = 1, paceMin = 1, paceMax = 1; ///< Of the closed ones.
    double gapMax = 0;                             ///< How far from its seed a closed track returned, world units.
};

/// The particles at one moment.
struct LoopMoment {
    Points points;      ///< With velocity, track and fade; what else the seeds have stays as it is.
    size_t outside = 0; ///< On the wrong side of the wall: those that were there from the beginning.
    size_t snapped = 0; ///< Points at a vertex of their table because no way back onto the track was found.
};

/// Particles in a steady flow that a wall contains, which after `duration` seconds are exactly where they began.
///
/// In such a flow practically every track closes, after a period T. A particle runs through its own track k = max(1,
/// round(duration/T)) times, at the pace s = kT/duration: its speed is s times that of the flow. s is between 2/3 and
/// 4/3, wherever T ≤ 4/3 duration. All others follow their track at the flow's own pace, from some time before the
/// beginning of the loop to some time after it (at random, so that not all begin anew at once), and Points::fade takes
/// them from 0 to 1 and back to 0 meanwhile; it is 1 for all that do not fade. At time 0 every particle is where it was
/// given.
///
/// Tracks are found once, by Dormand and Prince's pair with steps of adaptive length, each step reprojected and judged
/// as in advect(); they are tabulated by time, with velocity and acceleration. The place at any time is that of the
/// quintic Hermite interpolant, put back onto the track: so it costs the same at every time, and needs no earlier one.
/// If that fails, the particle is at the nearest vertex of the table, which is on its track: none is ever beyond the
/// wall.
///
/// The same bytes for any number of threads, and for times that differ by a whole number of durations: the phase of the
/// loop is rounded to 2⁻³² of it. Immutable, safe to share between threads.
class LoopedPoints {
  public:
    /// Finds the tracks of these particles. Throws ValueError for a flow without tracks or without a wall, for no
    /// reprojection and for options out of range; ResourceError if the tables would not fit into memory (estimated from
    /// a sample first); Interrupted.
    LoopedPoints(const Flow& flow, Points seeds, const LoopOptions& options, const Monitor& monitor = {});
    ~LoopedPoints();
    LoopedPoints(LoopedPoints&&) noexcept;
    LoopedPoints& operator=(LoopedPoints&&) noexcept;

    /// The particles at that time, seconds, of either sign. Throws ValueError if it is not finite; Interrupted.
    LoopMoment at(double time, const Monitor& monitor = {}) const;

    const LoopSummary& summary() const;
    LoopKind kind(size_t particle) const;
    /// Of a closed track, seconds; else 0.
    double period(size_t particle) const;
    /// The particle's speed relative to the flow's.
    double pace(size_t particle) const;

  private:
    class Implementation;
    std::unique_ptr<Implementation> mImplementation;
};

} // namespace curlew
