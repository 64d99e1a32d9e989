// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Flow.h"
#include "curlew/gpu/Gpu.h"
#include "curlew/shader/ShaderText.h"
#include "curlew/track/Stepper.h"

namespace curlew {

/// How a GPU moves points along a flow.
struct GpuMoveOptions {
    Scheme scheme = Scheme::rk4;
    double time = 1; ///< Seconds; negative runs backward.
    int steps = 0;   ///< Number of equal steps; 0: adaptive steps.
    /// For adaptive steps: as AdvectOptions::accuracy, and the length of the first step, seconds.
    double accuracy = 0, firstStep = 0;
    double rmsSpeed = 0; ///< Errors are weighted as delays relative to it (AdvectOptions::accuracy); 0: they are not.
    double maxStep = 0;  ///< World units; 0: no limit.
    int maxSubdivisions = 8; ///< A step that is not accepted is halved up to this many times.
    int corrections = 4;     ///< Largest number of corrections back onto the track after each step; 0: none.
    /// Residuals of f and g, relative to their root mean squares, below which no correction is made.
    double enough = 2.5e-6;
    bool limited = true; ///< Whether a correction is at most as long as the step.
    /// Whether a step is accepted only if it returned to its track and stays clear of the wall (track/Advect.h).
    bool guarded = true;
};

/// Points that a GPU moves, an entry of each array per point.
template <int N>
struct GpuPointsN {
    std::vector<Vec<double, N>> position;
    std::vector<std::array<double, size_t{N - 1}>>
        track;                      ///< The potentials' values to return to; empty: those at the positions.
    std::vector<float> pace;        ///< The fraction of the time for which each moves, 0 … 1.
    std::vector<uint8_t> converged; ///< Set to 0 if some step was not taken.
    std::vector<float> error;       ///< Set to the sum of estimated errors, world units.
};

/// What happened on the way: as in AdvectResult.
struct GpuMoved {
    size_t substeps = 0, retries = 0, stalled = 0, coarse = 0, corrections = 0;
};

/// A flow of two or three dimensions on a GPU, in float; positions are floats relative to the centre of the flow's box,
/// from which lattice cells are subtracted in double or as pairs of floats (shader/FlowShader.h, with its accuracy).
/// Its programs are compiled when they are first needed. Safe to share between threads; the GPU runs one program at a
/// time.
template <int N>
class GpuFlowN {
  public:
    /// Uses doubles if the GPU has them. Compares velocities with those of the processor at some positions, because
    /// drivers have been seen to change formulas. Throws ValueError if the flow cannot be written as a shader, GpuError
    /// if these velocities differ or the GPU fails, ResourceError if its memory does not suffice.
    GpuFlowN(std::shared_ptr<Gpu> gpu, const FlowN<N>& flow, const Monitor& monitor = {});
    /// Throws GpuError, too, if the GPU has no doubles and `coordinates` demand them.
    GpuFlowN(std::shared_ptr<Gpu> gpu, const FlowN<N>& flow, ShaderCoordinates coordinates,
             const Monitor& monitor = {});
    ~GpuFlowN();
    GpuFlowN(const GpuFlowN&) = delete;
    GpuFlowN& operator=(const GpuFlowN&) = delete;

    /// Computes the velocities at these positions. Throws GpuError if the GPU fails.
    void velocities(const std::vector<Vec<double, N>>& positions, std::vector<Vec<float, N>>& velocities,
                    const Monitor& monitor = {}) const;

    /// Moves points. Runs for about 0.1 s at a time, so that the monitor can cancel it and nothing else on the GPU
    /// waits long. Throws ValueError if the steps are adaptive and the scheme has no error estimate, and GpuError if
    /// the GPU fails.
    GpuMoved move(GpuPointsN<N>& points, const GpuMoveOptions& options, const Monitor& monitor = {}) const;

  private:
    void requireAgreement(const FlowN<N>& flow) const;

    struct OnGpu; // src/gpu/GpuFlow.cpp
    std::shared_ptr<Gpu> mGpu;
    std::unique_ptr<OnGpu> mFlow;
};

} // namespace curlew
