// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Flow.h"
#include "curlew/track/Points.h"
#include "curlew/track/Reproject.h"

namespace curlew {

struct LoopOptions {
    double duration = 2; ///< Seconds after which every particle is back at its start.
    /// Upper bound on the estimated error of a step along a track, world units; 0: a millionth of the diagonal of the
    /// domain's box.
    double accuracy = 0;
    size_t vertices = 4000; ///< Maximum per track. A track that needs more ends there, and its particle fades earlier.
    ReprojectionOptions reprojection = {};
};

/// The motion of a particle during a loop.
enum class LoopKind : uint8_t {
    closed, ///< It runs around its track a whole number of times.
    fading, ///< Its track takes longer than the loop or does not close: it fades in and out, then restarts.
    still   ///< It stays in place: beyond the wall, at a position that is not finite, or where the flow is zero.
};

struct LoopSummary {
    size_t points = 0, closed = 0, fading = 0, still = 0;
    size_t outside = 0;   ///< Still particles beyond the wall or on it.
    size_t vertices = 0;  ///< Of all tracks.
    size_t bytes = 0;     ///< Memory of all tracks.
    size_t coarse = 0;    ///< Steps that exceed `accuracy` but could not be shortened.
    size_t stuck = 0;     ///< Fading particles on whose track no further step was possible.
    size_t truncated = 0; ///< Fading particles whose track reached the maximum number of vertices.
    double paceMean = 1, paceMin = 1, paceMax = 1; ///< Of closed tracks.
    double gapMax = 0; ///< Largest distance from its seed at which a closed track returned, world units.
};

/// The particles at one time.
struct LoopMoment {
    Points points;      ///< With velocity, track and fade; other arrays are those of the seeds.
    size_t outside = 0; ///< On the wrong side of the wall; they were there from the beginning.
    size_t snapped = 0; ///< Points placed at a vertex of their table because reprojection failed.
};

/// Particles in a steady flow inside a wall that return exactly to their start after `duration` seconds.
///
/// In such a flow practically every track closes, after a period T. A particle runs along its own track k = max(1,
/// round(duration/T)) times, at the pace s = kT/duration: its speed is s times that of the flow. s is between 2/3 and
/// 4/3 if T ≤ 4/3 duration. All other particles follow their track at the flow's own pace. They are visible from some
/// time before the beginning of the loop to some time after it; this time is random, so they do not all restart at
/// once. Meanwhile Points::fade goes from 0 to 1 and back to 0; it is 1 for particles that do not fade. At time 0 every
/// particle is at its seed.
///
/// Tracks are computed once with the adaptive Dormand-Prince pair. Each step is reprojected and checked as in advect().
/// They are tabulated by time, with velocity and acceleration. The position at any time is that of the quintic Hermite
/// interpolant, reprojected onto the track, so it costs the same at every time and needs no earlier one. If
/// reprojection fails, the particle is placed at the nearest vertex of the table, which is on its track. So no particle
/// is ever beyond the wall.
///
/// The result has the same bytes for any number of threads, and for times that differ by a whole number of durations:
/// the phase of the loop is rounded to 2⁻³² of it. Immutable, safe to share between threads.
class LoopedPoints {
  public:
    /// Computes the tracks of these particles. Throws ValueError if the flow has no tracks or no wall, reprojection is
    /// off, or an option is out of range; ResourceError if the tables would not fit into memory (first estimated from a
    /// sample); Interrupted.
    LoopedPoints(const Flow& flow, Points seeds, const LoopOptions& options, const Monitor& monitor = {});
    ~LoopedPoints();
    LoopedPoints(LoopedPoints&&) noexcept;
    LoopedPoints& operator=(LoopedPoints&&) noexcept;

    /// Returns the particles at that time, seconds, of either sign. Throws ValueError if it is not finite; Interrupted.
    LoopMoment at(double time, const Monitor& monitor = {}) const;

    const LoopSummary& summary() const;
    LoopKind kind(size_t particle) const;
    /// Period of a closed track, seconds; otherwise 0.
    double period(size_t particle) const;
    /// The particle's speed relative to the flow's.
    double pace(size_t particle) const;

  private:
    class Implementation;
    std::unique_ptr<Implementation> mImplementation;
};

} // namespace curlew
