// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Diagnostics.h"
#include "curlew/vdb/GridTypes.h"

namespace curlew {

struct GridDiagnostics {
    size_t voxels = 0;            ///< Number of active voxels.
    size_t interior = 0;          ///< Active voxels whose stencil neighbours are active too.
    double divergence = 0;        ///< rms(div) * voxel size / rms|c| over the interior, by OpenVDB's operator (forward
                                  ///< differences if the grid is staggered).
    double divergenceOverall = 0; ///< The same over all active voxels; voxels beyond them count as background.
    double rmsSpeed = 0, maxSpeed = 0;
    /// Voxels that were left out because their centres are on the wrong side of the wall, or on it.
    size_t beyondWall = 0;
};

/// Measures the divergence of a velocity grid. If a wall is given, voxels of a staggered grid that have divergence on
/// its wrong side do not count: a solver ignores the velocities inside a collider.
GridDiagnostics diagnoseGrid(const openvdb::Vec3SGrid& velocity, const std::optional<Wall>& wall = {});

struct TrackDiagnostics {
    int steps = 0;
    double time = 0; ///< Seconds. In each step a point moves a quarter of a voxel at the rms speed.
    ParticleDiagnostics field = {}, onGrid = {}; ///< After steps of advect(), and after steps of OpenVDB's
                                                 ///< VelocityIntegrator on the grid.
};

/// Moves `points` points of the flow's domain through `steps` RK4 steps of equal length, twice: by the flow itself,
/// with Gauss-Newton reprojection, and by a velocity grid of it, as hosts do. Throws ValueError if the flow has no
/// tracks or does not move.
TrackDiagnostics diagnoseTracks(const Flow& flow, const openvdb::Vec3SGrid& velocity, int steps, size_t points = 1000,
                                const Monitor& monitor = {});

} // namespace curlew
