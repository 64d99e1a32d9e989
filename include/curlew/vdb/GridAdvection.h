// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/FlowMap.h"

#include <openvdb/openvdb.h>

namespace curlew {

/// How a grid is read between its voxels.
enum class Interpolation {
    linear,   ///< OpenVDB's BoxSampler: nothing lies beyond what the voxels have.
    quadratic ///< OpenVDB's QuadraticSampler: sharper, but it may overshoot.
};

struct GridAdvectionOptions {
    FlowMapOptions map = {}; ///< By default as accurate as forVoxels().
    Interpolation interpolation = Interpolation::linear;
};

struct AdvectedGrid {
    openvdb::GridBase::Ptr grid;
    size_t traced = 0; ///< Voxels that were followed back.
    size_t kept = 0;   ///< Of these: some step left them in place (FlowMapResult).
};

/// What a grid of floats or vectors (of floats) holds, as a flow carries it from the time `begin` for `time` seconds:
/// density, temperature, colour. q(x, t) = q₀(X(x, -t)), so it is interpolated once, however long the time is; vectors
/// are carried along as three numbers, they are not turned. Active are the voxels that are not as the background; they
/// are found by following the active ones of the original. In a divergence-free flow the sum over all voxels stays, as
/// far as voxels resolve what the flow stretches.
/// Throws ValueError for other types of grids, level sets (LevelSetAdvection.h), staggered grids, values that are not
/// finite, and grids without an active voxel; ResourceError where the grid becomes too large.
AdvectedGrid advectGrid(const openvdb::GridBase& grid, const FlowInTime& flow, double begin, double time,
                        const GridAdvectionOptions& options = {}, const Monitor& monitor = {});

} // namespace curlew
