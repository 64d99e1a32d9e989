// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Diagnostics.h"

#include <openvdb/openvdb.h>

namespace curlew {

struct GridDiagnostics {
    size_t voxels = 0;   ///< Active ones.
    size_t interior = 0; ///< Active ones whose neighbours in the stencil are active too.
    double divergence =
        0; ///< rms(div) voxel / rms|c| over the interior, by OpenVDB's operator (forward differences if staggered).
    double divergenceOverall = 0; ///< The same over all active voxels; what lies beyond them counts as background.
    double rmsSpeed = 0;
};

GridDiagnostics diagnoseGrid(const openvdb::Vec3SGrid& velocity);

struct TrackDiagnostics {
    int steps = 0;
    double time = 0; ///< Seconds: in a step a point moves by a quarter of a voxel at the rms speed.
    ParticleDiagnostics field = {},
                        onGrid = {}; ///< After steps of advect(); and of OpenVDB's VelocityIntegrator on the grid.
};

/// Moves `points` points of the flow's domain twice through `steps` RK4 steps of the same length: by the flow itself,
/// with Gauss-Newton reprojection, and by a velocity grid of it, as hosts do. Throws ValueError for a flow without
/// tracks.
TrackDiagnostics diagnoseTracks(const Flow& flow, const openvdb::Vec3SGrid& velocity, int steps, size_t points = 1000,
                                const Monitor& monitor = {});

} // namespace curlew
