// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Flow.h"
#include "curlew/track/Points.h"
#include "curlew/track/Scatter.h"

#include <limits>
#include <span>

namespace curlew {

struct EmissionOptions {
    double rate = 1000;                                    ///< Births per second.
    double life = std::numeric_limits<double>::infinity(); ///< The age at which particles die, seconds.
    double spread = 0; ///< Lifetimes vary by up to this fraction of `life`, uniformly at random.
    uint64_t seed = 0;
    /// Where in the domain particles are born; its seed is ignored.
    ScatterOptions place = {};
    /// World units per second. Particles born on a surface leave it along its normal at this speed until the end of the
    /// frame of their birth, away from the object on the side that `place` gives.
    double normalSpeed = 0;
};

/// The state of an emitter between frames.
struct EmissionState {
    double rates = 0;   ///< The sum of the rates of all frames so far.
    int64_t nextId = 0; ///< Id of the next particle.
};

/// Returns the particles born in a frame of `duration` seconds: uniform in the domain and evenly spaced in time, with
/// position, id, and age at the end of the frame; also with a life if `life` is finite. Particle `id` depends only on
/// the seed and its id. After any number of frames of equal rate and duration, the number of births is that of one long
/// frame. Particles whose life ends within the frame are left out. Throws ValueError if the rate or the duration is
/// negative or not finite, like scatter(), and ResourceError if the births do not fit into memory.
Points emitted(const Domain& domain, const EmissionOptions& options, double duration, EmissionState& state,
               const Monitor& monitor = {});

/// Does the same for a domain that moves: `domains` are those of equal intervals of the frame, in their order.
Points emitted(std::span<const Domain> domains, const EmissionOptions& options, double duration, EmissionState& state,
               const Monitor& monitor = {});

/// Gives `born` the arrays that `others` have: the velocity of the flow, and the track on which each particle starts.
void joinFlow(const Flow& flow, const Points& others, Points& born);

/// Returns one flag per particle: 1 if the particle is on a side of the domain's wall that is not allowed, or closer to
/// the wall than float rounding (classify()). Ignores the box.
std::vector<uint8_t> flagBeyondWall(const Points& particles, const Domain& domain, const Monitor& monitor = {});

/// Wraps particles that have left the box to its opposite face, as in a space that is periodic in the box. Along an
/// axis in which the box has no extent, particles stay where they are. Throws ValueError if the box is infinite.
void wrap(Points& particles, const Box& box);

} // namespace curlew
