// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/field/Shapes.h"
#include "curlew/vdb/MeshFile.h"

#include <openvdb/openvdb.h>

#include <memory>

namespace curlew {

/// A narrow-band signed distance grid, and the mesh that it was made from, if there is one.
struct LevelSet {
    openvdb::FloatGrid::ConstPtr grid;
    std::shared_ptr<const Mesh> mesh;

    double voxelSize() const { return grid->voxelSize()[0]; }
    /// Half width of the narrow band, in voxels.
    double halfWidth() const { return static_cast<double>(grid->background()) / voxelSize(); }
};

struct MeshToLevelSetOptions {
    double voxel = 0;     ///< Voxel size, world units; 0: from dim.
    int dim = 256;        ///< Voxels along the longest edge of the mesh's box, where no voxel size is given.
    double halfWidth = 3; ///< Of the narrow band, in voxels.
};

/// The level set of the solid of any mesh (MeshSolid.h). Throws ValueError for a mesh that is degenerate or encloses
/// nothing at this resolution, and for sizes that are not positive; ResourceError where the band would not fit the
/// memory.
LevelSet meshToLevelSet(std::shared_ptr<const Mesh> mesh, const MeshToLevelSetOptions& options,
                        const Monitor& monitor = {});

/// A grid as a level set. Throws ValueError unless it is a float level set with finite values and cubic voxels.
LevelSet levelSetOf(const openvdb::GridBase::ConstPtr& grid);

/// The box of what is inside, and a voxel more around it, world units.
Box boundsOf(const LevelSet& levelSet);

/// The same surface with a narrow band of at least `halfWidth` voxels: made anew from the mesh where there is one; else
/// the band is extended by OpenVDB's fast sweeping, which keeps the values that are there. The request is judged
/// first: throws ResourceError, with a half width that would do, for a band of more than about 10⁸ voxels (tens of
/// seconds), and for one that does not fit the memory.
LevelSet widened(const LevelSet& levelSet, double halfWidth, const Monitor& monitor = {});

/// Voxels beyond a position that the spline below needs of the band: two for itself and one for its prefilter.
inline constexpr double kSplineSupport = 3;

/// The level set as a C² field: the tricubic B-spline through its samples, with exact derivatives.
///
/// The samples are prefiltered by c = s - (1/6) Σ δᵢ² s, with which the spline reproduces cubics: its value is off by
/// O(h⁴), its gradient by O(h³), its Hessian by O(h²). (Without that, its surface would shrink by h² κ/6 for a
/// curvature κ.) The result is a distance where |d| < `reach` = the half width less kSplineSupport; beyond, it levels
/// off at the background.
Sdf sdfOf(const LevelSet& levelSet);

} // namespace curlew
