// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Flow.h"
#include "curlew/vdb/GridTypes.h"

#include <vector>

namespace curlew {

// Velocity grids (of a fluid solver, or our own) as flows.

/// A velocity grid: one grid of vectors (float or double), or three scalar grids of the components x, y and z.
///
/// Three layouts are known. Collocated: velocities at the centres of the voxels, in world space. Staggered (MAC,
/// GRID_STAGGERED): component k at the centre of the lower face of the voxel along index axis k, in the direction of
/// that axis. Three grids whose origins differ by half voxels are staggered, too. The voxels must be cubes, in any
/// position and orientation. Values outside the active voxels count as they are, usually 0.
using VelocityGrids = std::vector<std::shared_ptr<const openvdb::GridBase>>;

/// Returns whether velocity grids are staggered. Throws ValueError as sampledFlow() does.
bool isStaggered(const VelocityGrids& grids);

enum class GridSampling {
    linear, ///< Trilinear, as hosts sample it: continuous, with jumps of the derivatives.
    cubic,  ///< Tricubic B-spline, as gridField(): C², smoother than the grid by its fourth order of accuracy.
};
inline constexpr std::array<std::string_view, 2> kGridSamplingNames{"linear", "cubic"};

/// Returns the interpolated velocity as a flow in the box of the active voxels. It is not divergence-free, even if the
/// grid is: points gather and thin out, and may cross walls. Throws ValueError if there is neither one grid of vectors
/// nor three grids of scalars, or if they have no active voxels, values that are not finite, voxels that are not cubes,
/// or voxels that do not match.
Flow sampledFlow(const VelocityGrids& grids, GridSampling sampling = GridSampling::linear, const Monitor& monitor = {});

struct PotentialFlowOptions {
    /// An obstacle or a container, at rest. The flow becomes tangent to it; voxels whose centres are on its other side
    /// are solid.
    std::optional<Wall> wall = {};
};

/// A velocity grid as a sum of terms ∇ψ_k × ∇x_k, and how far it is from the grid.
struct PotentialFlow {
    Flow flow;
    Vec<int, 3> cells;     ///< Number of voxels along each axis of the grid.
    double divergence = 0; ///< Rms net flux out of a voxel as given, relative to the rms velocity through its faces.
    double change = 0;     ///< Rms change of the velocities through the faces, relative to their rms.
    double residual = 0;   ///< As `divergence`, of the flow.
    int iterations = 0;    ///< Of all solvers.
    /// Number of solids, or closed sides of the box, with a hole through which the flow passes: a torus, or the sides
    /// of a channel. The terms of the flow are not tangent to them before they are ramped.
    size_t channels = 0;
};

/// Returns the velocity grid as a flow with vector potentials: pointwise divergence-free, with a continuous velocity
/// gradient, and with the same fluxes through the faces of the voxels as the grid. This is the idea of Curl-Flow
/// (Chang, Partono, Azevedo and Batty 2022), with splines of a discrete de Rham complex (Buffa et al. 2011,
/// EdgeSpline.h). The velocity is accurate to the third order in the size of the voxels.
///
/// If the grid is not divergence-free (a collocated grid is averaged to the faces first), its velocities are projected:
/// the gradient of a pressure is subtracted, where nothing flows through solids and closed sides of the box; the
/// pressure beyond other sides is zero. The result says by how much the velocities have changed.
///
/// The terms are smooth, since the divergence of ψ is zero (Coulomb gauge), and tangent to the closed sides of the box.
/// With a wall, ψ is ramped to zero at it (layerRamp), so that every term is tangent to the wall: particles that follow
/// term by term (Splitting) do not cross it. Beyond the box of the grid, what leaves it
/// goes on, and the motion along its sides ends within a voxel.
///
/// Throws ValueError as sampledFlow() does, if there are fewer than 4 voxels along an axis, if most of the motion is on
/// the wrong side of the wall, or if a solver does not converge; ResourceError if there is not enough memory.
PotentialFlow potentialFlow(const VelocityGrids& grids, const PotentialFlowOptions& options = {},
                            const Monitor& monitor = {});

} // namespace curlew
