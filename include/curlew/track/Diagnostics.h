// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Flow.h"
#include "curlew/track/Points.h"

#include <optional>

namespace curlew {

/// Measurements of what the library promises. All from seeded samples: the same for every call.

struct FieldDiagnostics {
    Range range;            ///< Of the values seen.
    double rms = 0;         ///< Root mean square of the values,
    double rmsGradient = 0; ///< and of the length of the gradient.
    /// How far gradients by central differences are from the exact ones: root mean square, relative to rmsGradient, for
    /// h = 1/4096 of the box's longest edge, and for half of it. Their ratio tells the order: 4 for the second.
    double byDifferences = 0, byHalfDifferences = 0;
};

/// From `samples` positions in the box.
template <int N>
FieldDiagnostics diagnoseField(const ScalarFieldN<N>& field, const BoxN<N>& box, size_t samples = 100000,
                               const Monitor& monitor = {});

struct DivergenceDiagnostics {
    double trace = 0;       ///< Greatest |trace| / Frobenius norm of the velocity's Jacobian, in the domain.
    double traceBeyond = 0; ///< The same where the wall has no part: deeper than its width.
    /// rms of the divergence by central differences of the velocity over ±`step`, and over half of it, relative to the
    /// rms of the Jacobian's norm. The trace above vanishes for any symmetric Hessians; this one also tells whether the
    /// gradients are those of a function without kinks.
    double byDifferences = 0, byHalfDifferences = 0;
    /// World units: 1/128 of rms speed / rms norm of the Jacobian, so that the figures do not depend on the flow's
    /// scale. 0 for a flow that is the same everywhere.
    double step = 0;

    /// The power of the step with which `byDifferences` falls: 2 where the velocity is C³, at least 1.5 where it is C¹
    /// with bounded second derivatives; 1/2 where its derivatives jump, 0 where a gradient is none, -1/2 where the
    /// velocity jumps, as it does at the kink of a potential. nullopt if there is nothing but rounding.
    std::optional<double> order() const;
    /// Whether the divergence by differences is rounding, or falls with the step: by a power above 1/4.
    bool vanishes() const;
};

/// From `samples` points of the domain, with Hessians in double. The points of a domain in space are scattered;
/// elsewhere they are uniform in its box, and those beyond a wall do not count. A kink is only seen by the samples
/// within a step of it: so few samples may miss it.
template <int N>
DivergenceDiagnostics diagnoseDivergence(const FlowN<N>& flow, size_t samples = 100000, const Monitor& monitor = {});

struct FlowDiagnostics {
    DivergenceDiagnostics divergence;
    double wallFlux = 0;    ///< Greatest |c · grad d| on the wall, relative to the rms speed.
    size_t wallSamples = 0; ///< How many points of the wall that is from.
    FlowMagnitudes magnitudes;
};

/// From `samples` points of the domain, and as many on its wall, found by Newton's method on d.
FlowDiagnostics diagnoseFlow(const Flow& flow, size_t samples = 100000, const Monitor& monitor = {});

struct ParticleDiagnostics {
    size_t points = 0;
    size_t outside = 0;      ///< On the wrong side of the wall, or on it.
    size_t notConverged = 0; ///< Of which some step could not be brought back onto the track.
    double penetration =
        0; ///< Greatest distance beyond the wall, world units; negative: all keep clear of it by so much.
    double driftF = 0, driftG = 0; ///< rms of f - f0 and g - g0 over the converged points, relative to the rms of f and
                                   ///< g over the domain.
};

/// Compares particles with the flow that moved them. Drift needs tracks of both (zero without).
ParticleDiagnostics diagnoseParticles(const Flow& flow, const Points& particles, const Monitor& monitor = {});

} // namespace curlew
