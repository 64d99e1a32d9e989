// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Flow.h"
#include "curlew/track/WallVelocity.h"
#include "curlew/vdb/GridTypes.h"
#include "curlew/vdb/Voxels.h"

#include <functional>
#include <vector>

namespace curlew {

enum class Layout {
    collocated, ///< Velocities at voxel centres.
    staggered,  ///< Component k at the centre of the voxel's lower face along axis k (MAC); divergence-free to
                ///< rounding.
};

/// What computes the velocities of a flow at positions in place of Flow::velocity(), such as a GPU.
using VelocitySource = std::function<void(const std::vector<Vec3d>& positions, std::vector<Vec3f>& velocities)>;

struct VelocityGridOptions {
    double voxel = 0; ///< Voxel size in world units; 0 means that `dim` determines it.
    int dim = 128;    ///< Voxels along the longest edge of the domain's box, if no voxel size is given.
    Layout layout = Layout::collocated;
    std::shared_ptr<const openvdb::GridBase> mask = {}; ///< If given, the grid has the mask's transform and exactly its
                                                        ///< active voxels; `voxel` and `dim` are ignored.
    double wallFade = 3; ///< Voxels beyond a one-sided wall over which the flow fades to zero.
    /// Motion of the flow's wall; nullopt if it is at rest. With it, the grid holds u = c + w: the flow c relative to
    /// the wall, plus the velocity w that the moving wall adds.
    std::optional<WallVelocity> moving = {};
    /// If given, the velocity of displaced air (DisplacedAir.h) in the box of the flow's domain, which is added instead
    /// of w. Must have the voxels of this grid.
    std::shared_ptr<const openvdb::Vec3SGrid> displaced = {};
    /// If given, makes the source of the velocities of this flow. For collocated grids only.
    std::function<VelocitySource(const Flow&)> source = {};
};

/// Returns the voxels that these options give. Throws ValueError as velocityGrid() does.
Voxels voxelsOf(const Flow& flow, const VelocityGridOptions& options);

/// Samples the flow on a sparse grid over its domain: world units per second, contravariant, background 0.
///
/// A voxel is active if its centre is in the domain's box and on the flow's side of its wall or within the wall fade.
/// In the wall fade, f is multiplied by a factor β(d) that falls from 1 to 0. The flow there is ∇(βf) × ∇g, which is
/// divergence-free. (On a staggered grid, f and g are first exchanged or shifted by a constant where that adds less
/// velocity.) It stays tangential to the wall as far as trilinear interpolation reaches (1.75 voxels), and joins the
/// background without a jump.
///
/// Staggered: the flux through a face is the circulation of f dg around its edges (Stokes, c = curl(f ∇g);
/// docs/math.md), with f and g at the corners of the voxels in double. It is second-order accurate, and the fluxes of
/// each voxel cancel. If the flow is inside a wall, they cancel for all voxels; otherwise for all but the last layer of
/// the box or mask.
///
/// A moving wall (`moving`) adds w. Around a rigid body, w does not fade inside the body: all of the body is active and
/// has the body's velocity, so whatever gets inside moves along with it. The terms ∇((1−α) a) × ∇b of w have the form
/// of the flow's own, so a staggered grid stays divergence-free. A deforming wall adds point values of the velocity of
/// its surface, which are not divergence-free. Instead, `displaced` adds a potential flow, which is.
///
/// The result has the same bytes for any number of threads. Throws ValueError if a size is not positive, the box is
/// infinite, the voxels of the mask are not cubes along the axes, the voxels of `displaced` differ from those of this
/// grid, a staggered grid of a flow that is not divergence-free is requested, or one with a `source`;
/// ResourceError if the grid would not fit in memory.
std::shared_ptr<openvdb::Vec3SGrid> velocityGrid(const Flow& flow, const VelocityGridOptions& options,
                                                 const Monitor& monitor = {});

} // namespace curlew
