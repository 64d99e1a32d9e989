// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Flow.h"
#include "curlew/track/WallVelocity.h"

#include <openvdb/openvdb.h>

namespace curlew {

enum class Layout {
    collocated, ///< Velocities at voxel centres.
    staggered,  ///< Component k on the voxel's face towards -k (MAC); divergence-free to rounding.
};

struct VelocityGridOptions {
    double voxel = 0; ///< Voxel size, world units; 0: from dim.
    int dim = 128;    ///< Voxels along the longest edge of the domain's box, where no voxel size is given.
    Layout layout = Layout::collocated;
    openvdb::GridBase::ConstPtr mask =
        {};              ///< If given: exactly its active voxels, in its transform; voxel and dim do not count.
    double wallFade = 3; ///< Voxels by which the grid reaches beyond a one-sided wall, while the flow fades to zero.
    /// How the flow's wall moves; nothing if it rests. The grid then holds u = c + w: the flow c as it is seen with the
    /// wall at rest, and what the wall adds to it.
    std::optional<WallVelocity> moving = {};
};

/// Samples the flow on a sparse grid over its domain: world units per second, contravariant, background 0.
///
/// A voxel is active if its centre is in the domain's box and on the flow's side of its wall or within the wall fade.
/// In the wall fade f is multiplied by a factor β(d) that falls from 1 to 0. The flow there is ∇(βf) × ∇g, which is
/// divergence-free; it stays tangential to the wall as far as trilinear interpolation reaches (1.75 voxels) and meets
/// the background without a jump.
///
/// Staggered: the flux through a face is the circulation of f dg around its edges (Stokes, c = curl(f ∇g);
/// docs/math.md), with f and g at the voxels' corners in double: second-order accurate, and the fluxes of each voxel
/// cancel. If the flow is inside a wall, that holds for all voxels; otherwise for all but the last layer of the box or
/// mask.
///
/// A wall that moves (`moving`) adds w to that. Around a rigid body w does not fade in the body, all of which is active
/// and moves as the body does: what gets there goes along with it. Its terms ∇((1−α) a) × ∇b are terms like those of
/// the flow, so a staggered grid stays divergence-free. A wall that changes its form adds point values, of the normal
/// velocity, which are not divergence-free.
///
/// Same bytes for any number of threads. Throws ValueError for a size that is not positive, an infinite box, a mask
/// whose voxels are not axis-aligned cubes, and a staggered grid of a normalised flow; ResourceError if the grid would
/// not fit the memory.
openvdb::Vec3SGrid::Ptr velocityGrid(const Flow& flow, const VelocityGridOptions& options, const Monitor& monitor = {});

} // namespace curlew
