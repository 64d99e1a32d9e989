#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Flow.h"

#include <openvdb/openvdb.h>

#include <string>

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
        {};          ///< If given: exactly its active voxels, in its transform; voxel and dim do not count.
    double skin = 3; ///< Voxels by which the grid reaches beyond a one-sided wall, while the flow fades to zero.
};

/// The flow on a sparse grid over its domain: world units per second, contravariant, background 0.
///
/// Active are the voxels whose centres lie in the domain's box and on the flow's side of its wall or within the skin.
/// In the skin f is multiplied by a fade β(d) from 1 to 0: c there is still ∇(βf) × ∇g, divergence-free; it keeps its
/// direction along the wall as far as trilinear interpolation reaches (1.75 voxels) and ends in the background without
/// a jump.
///
/// Staggered: the flux through a face is the circulation of f dg around its edges (Stokes, c = curl(f ∇g);
/// docs/math.md), from f and g at the voxels' corners in double: second-order accurate, and the fluxes of each voxel
/// cancel. Where the flow is inside a wall that holds for all voxels; else for all but the last layer of the box or
/// mask.
///
/// Same bytes for any number of threads. Throws ValueError for sizes that are not positive, an infinite box, a mask
/// that is not on cubic, axis-aligned voxels, and a staggered grid of a normalised flow; ResourceError where the grid
/// would not fit the memory.
openvdb::Vec3SGrid::Ptr velocityGrid(const Flow& flow, const VelocityGridOptions& options, const Monitor& monitor = {});

/// A field at the voxel centres of the active voxels of `where`.
openvdb::FloatGrid::Ptr sampledGrid(const ScalarField& field, const openvdb::GridBase& where, const std::string& name,
                                    const Monitor& monitor = {});

/// A fog volume of the domain on the active voxels of `where`: 1 where the flow is, falling to 0 over the last two
/// voxels before the wall.
openvdb::FloatGrid::Ptr densityGrid(const Domain& domain, const openvdb::GridBase& where, const Monitor& monitor = {});

} // namespace curlew
