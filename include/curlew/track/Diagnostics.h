// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Flow.h"
#include "curlew/track/Points.h"

#include <optional>

namespace curlew {

/// Measurements of the library's guarantees. All use seeded samples, so every call gives the same result.

struct FieldDiagnostics {
    Interval range;         ///< Of the sampled values.
    double rms = 0;         ///< Of the values.
    double rmsGradient = 0; ///< Of the gradient's length.
    /// Root mean square error of central differences against the exact gradient, relative to rmsGradient, for h =
    /// 1/4096 of the box's longest edge and for half of that. Their ratio shows the order: 4 for second order.
    double byDifferences = 0, byHalfDifferences = 0;
};

/// Measures a field at `samples` positions in the box.
template <int N>
FieldDiagnostics diagnoseField(const ScalarFieldN<N>& field, const BoxN<N>& box, size_t samples = 100000,
                               const Monitor& monitor = {});

/// For a flow that preserves the area of level sets (FlowN::preservesArea), the divergence is that within them.
struct DivergenceDiagnostics {
    /// Maximum of |trace| / Frobenius norm of the velocity's Jacobian in the domain; infinite if the velocity or its
    /// Jacobian is not finite at a sample.
    double trace = 0;
    double traceBeyond = 0; ///< The same over points where the wall has no influence: farther from it than its width.
    /// rms of the divergence by central differences of the velocity over ±`step` and over half of that, relative to the
    /// rms of the Jacobian's norm. `trace` vanishes for any symmetric Hessians; these figures also show whether the
    /// gradients are those of a function without kinks.
    double byDifferences = 0, byHalfDifferences = 0;
    /// World units: 1/128 of rms speed / rms norm of the Jacobian, so the figures do not depend on the flow's scale. 0
    /// for a uniform flow.
    double step = 0;

    /// The power of the step with which `byDifferences` falls: 2 if the velocity is C³, at least 1.5 if it is C¹ with
    /// bounded second derivatives, 1/2 if its derivatives jump, 0 if a potential's gradient is wrong, -1/2 if the
    /// velocity jumps, as at the kink of a potential. Returns nullopt if only rounding errors remain, NaN if a
    /// velocity is not finite.
    std::optional<double> order() const;
    /// Whether the flow is finite at all samples, and the divergence by differences is rounding error or falls with the
    /// step, by a power above 1/4.
    bool vanishes() const;
};

/// Measures the divergence at `samples` points of the domain, with Hessians in double precision. In 3D the points are
/// scattered in the domain. In other dimensions they are uniform in its box, and points beyond a wall are dropped. Only
/// samples within a step of a kink see it, so few samples may miss it.
template <int N>
DivergenceDiagnostics diagnoseDivergence(const FlowN<N>& flow, size_t samples = 100000, const Monitor& monitor = {});

struct FlowDiagnostics {
    DivergenceDiagnostics divergence;
    double wallFlux = 0;    ///< Maximum of |c · grad d| on the wall, relative to the rms speed; infinite for NaN.
    size_t wallSamples = 0; ///< Number of points on the wall that were used.
    FlowRms rms;
};

/// Measures the divergence at `samples` points of the domain, and the flux at up to as many points of its wall.
/// Newton's method on d moves them from near the wall onto it.
FlowDiagnostics diagnoseFlow(const Flow& flow, size_t samples = 100000, const Monitor& monitor = {});

struct ParticleDiagnostics {
    size_t points = 0;
    /// Points on the wrong side of the wall, or closer to the wall than float rounding (classify()).
    size_t outside = 0;
    size_t notConverged = 0; ///< Points that some step could not return to their track.
    double penetration = 0; ///< Largest distance beyond the wall, world units; negative if all points keep clear of it.
    double driftF = 0, driftG = 0; ///< rms of f - f0 and g - g0 over the converged points, relative to the rms of f and
                                   ///< g over the domain.
};

/// Compares particles with the flow that moved them. The drift is 0 unless both the flow and the particles have tracks.
ParticleDiagnostics diagnoseParticles(const Flow& flow, const Points& particles, const Monitor& monitor = {});

} // namespace curlew
