#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Dfvn.h"
#include "curlew/track/Particles.h"

#include <openvdb/openvdb.h>

namespace curlew {

/// Measurements of what the library promises. All from seeded samples: the same for every call.

struct FlowCheck {
    double divergence = 0; ///< Greatest |trace| / Frobenius norm of the velocity's Jacobian, in the domain.
    /// rms of the divergence by central differences of the velocity, relative to the same norm. The trace above
    /// vanishes for any symmetric Hessians; this one also tells whether the gradients are those of a function. Its own
    /// error is O(h²) with h = 1e-5 of the box, more where the flow is only C¹.
    double divergenceByDifferences = 0;
    double divergenceBeyond = 0; ///< The first, where the wall has no part: deeper than its width.
    double wallFlux = 0;         ///< Greatest |c · grad d| on the wall, relative to the rms speed.
    size_t wallSamples = 0;      ///< How many points of the wall that is from.
    FlowMagnitudes magnitudes;
};

/// From `samples` points of the domain, with Hessians in double, and as many on its wall, found by Newton's method on
/// d.
FlowCheck checkFlow(const Dfvn& flow, size_t samples = 100000, const Monitor& monitor = {});

struct GridCheck {
    size_t voxels = 0;   ///< Active ones.
    size_t interior = 0; ///< Active ones whose neighbours in the stencil are active too.
    double divergence =
        0; ///< rms(div) voxel / rms|c| over the interior, by OpenVDB's operator (forward differences if staggered).
    double divergenceOverall = 0; ///< The same over all active voxels; what lies beyond them counts as background.
    double rmsSpeed = 0;
};

GridCheck checkVelocity(const openvdb::Vec3SGrid& velocity);

struct ParticleCheck {
    size_t points = 0;
    size_t outside = 0;      ///< On the wrong side of the wall, or on it.
    size_t notConverged = 0; ///< Of which some step could not be brought back onto the track.
    double penetration =
        0; ///< Greatest distance beyond the wall, world units; negative: all keep clear of it by so much.
    double driftF = 0, driftG = 0; ///< rms of f - f0 and g - g0 over the converged points, relative to the rms of f and
                                   ///< g over the domain.
};

/// Compares particles with the flow that moved them. Drift needs their track (zero without).
ParticleCheck checkParticles(const Dfvn& flow, const Particles& particles, const Monitor& monitor = {});

} // namespace curlew
