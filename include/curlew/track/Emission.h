// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Flow.h"
#include "curlew/track/Points.h"
#include "curlew/track/Scatter.h"

#include <limits>

namespace curlew {

struct EmissionOptions {
    double rate = 1000;                                    ///< Births per second.
    double life = std::numeric_limits<double>::infinity(); ///< The age at which particles die, seconds.
    double spread = 0; ///< Lives differ by up to this fraction of `life`, uniformly at random.
    uint64_t seed = 0;
    /// Where in the domain they are born; its seed does not count.
    ScatterOptions place = {};
    /// World units per second: on a surface, they leave it along its normal, away from the object on the side of
    /// `place`, until the end of the frame in which they are born.
    double normalSpeed = 0;
};

/// What a source remembers from frame to frame.
struct EmissionState {
    double rates = 0;   ///< The sum of the rates of all frames so far.
    int64_t nextId = 0; ///< That of the next particle.
};

/// The particles that are born in a frame of `duration` seconds: uniform in the domain and evenly spaced in time, with
/// position, id, and their age at the end of the frame; also a life, if that is finite. Particle `id` depends on the
/// seed and its id alone. After any number of frames of equal rate and duration the number of births is that of one
/// long frame. A particle whose life ended within the frame is left out. Throws as scatter(), and ResourceError if the
/// births do not fit into memory.
Points emitted(const Domain& domain, const EmissionOptions& options, double duration, EmissionState& state,
               const Monitor& monitor = {});

/// Gives `born` what the particles that they join have: the velocity of the flow, and the track on which they start.
void joinFlow(const Flow& flow, const Points& others, Points& born);

/// One flag per particle: 1 if it is on a side of the domain's wall that is not allowed. The box is not judged.
std::vector<uint8_t> flagBeyondWall(const Points& particles, const Domain& domain, const Monitor& monitor = {});

/// Moves particles that have left the box back in at its opposite face, as in a space whose periods are its edges.
/// Throws ValueError if the box is infinite.
void wrap(Points& particles, const Box& box);

} // namespace curlew
