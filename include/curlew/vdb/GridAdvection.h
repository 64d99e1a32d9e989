// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/FlowMap.h"
#include "curlew/vdb/GridTypes.h"

namespace curlew {

/// How a grid is interpolated between its voxels.
enum class Interpolation {
    linear,   ///< OpenVDB's BoxSampler: results stay within the range of the voxels' values.
    quadratic ///< OpenVDB's QuadraticSampler: sharper, but it may overshoot.
};

struct GridAdvectionOptions {
    FlowMapOptions map = {}; ///< The default accuracy is that of forVoxels().
    Interpolation interpolation = Interpolation::linear;
};

struct AdvectedGrid {
    std::shared_ptr<openvdb::GridBase> grid;
    size_t traced = 0;  ///< Voxels traced back along the flow.
    size_t stalled = 0; ///< Traced voxels that some step left in place (FlowMapResult::stalled).
    size_t overrun = 0; ///< How often a moving wall left a traced voxel on its wrong side (FlowMapResult::overrun).
};

/// Advects a grid of floats or vectors of floats (density, temperature, colour) with a flow, from the time `begin` for
/// `time` seconds.
///
/// q(x, t) = q₀(X(x, -t)), where X is the flow map. The original is interpolated once, however long the time is, so
/// nothing diffuses from step to step. The components of a vector are advected as three scalars; the vector is not
/// rotated. A voxel of the result is active if its value differs from the background. These voxels are found by
/// following the active voxels of the original. In a divergence-free flow the sum over all voxels is conserved, as far
/// as the voxels resolve the stretching of the flow. A moving wall pushes the matter near it, as it pushes particles;
/// none of it gets inside the wall, except by the interpolation of the original.
///
/// Throws ValueError for other grid types, level sets (use LevelSetAdvection.h), staggered grids, nonlinear transforms,
/// values that are not finite, and grids without active voxels. Throws ResourceError if the grid becomes too large.
AdvectedGrid advectGrid(const openvdb::GridBase& grid, const FlowInTime& flow, double begin, double time,
                        const GridAdvectionOptions& options = {}, const Monitor& monitor = {});

} // namespace curlew
