// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/field/Shapes.h"
#include "curlew/vdb/GridTypes.h"
#include "curlew/vdb/MeshFile.h"

#include <memory>

namespace curlew {

/// A narrow-band signed distance grid, and the mesh that it was made from, if any.
struct LevelSet {
    std::shared_ptr<const openvdb::FloatGrid> grid;
    std::shared_ptr<const Mesh> mesh;

    double voxelSize() const;
    double halfWidth() const; ///< Half width of the narrow band, in voxels.
};

struct SolidOptions {
    double voxel = 0;     ///< Voxel size in world units; 0 means that `dim` determines it.
    int dim = 256;        ///< Voxels along the longest edge of the mesh's box, if no voxel size is given.
    double halfWidth = 3; ///< Half width of the narrow band, in voxels.
    double thickness = 0; ///< If above 0, the mesh is a sheet of this thickness in world units, half on either side.
    bool measureParts = true; ///< Whether to measure how thin the parts of the solid are: thin, missing and enough.
};

/// Converts the solid of any mesh to a level set, as solidOf() does (MeshSolid.h), without measuring its parts. Throws
/// ValueError if the mesh is degenerate or encloses nothing at this resolution, or if a size is not positive. Throws
/// ResourceError if the band would not fit in memory.
LevelSet meshToLevelSet(std::shared_ptr<const Mesh> mesh, SolidOptions options, const Monitor& monitor = {});

/// Casts a grid to a level set. The background is taken for the width of the band. Many grids that were made from
/// arrays have a marker such as 1000 there, and perhaps in voxels beyond the band, with another value inside. So if the
/// greatest absolute value of active voxels, or the second greatest, is more than four times the next, and by more than
/// two voxels, voxels from there on are no distances. If there are such, or if the background is more than twice the
/// greatest distance, a copy is returned: its background is that distance and a voxel. If the greatest distance is the
/// background, as in an array of clipped distances, voxels there are no distances either; in a copy, they are inactive.
/// Throws ValueError unless it is a float level set with finite values, a positive background and cubic voxels, and
/// encloses something.
LevelSet levelSetOf(const std::shared_ptr<const openvdb::GridBase>& grid);

/// Returns the bounding box of the inside, padded by one voxel, in world units.
Box boundsOf(const LevelSet& levelSet);

/// Returns the same surface with a narrow band of at least `halfWidth` voxels. If the level set has a mesh, the level
/// set is made again from it. Otherwise OpenVDB's fast sweeping extends the band and keeps the existing values. Checks
/// the request first: throws ResourceError if the band would not fit in memory, or if it would have more than about 10⁸
/// voxels (tens of seconds); that message names a half width that would do.
LevelSet widened(const LevelSet& levelSet, double halfWidth, const Monitor& monitor = {});

/// Voxels of the band that the spline of sdfOf() needs around a position: two for its support and one for its
/// prefilter.
inline constexpr double kSplineSupport = 3;

/// Returns the level set as a C² field: the tricubic B-spline through its samples, with exact derivatives.
///
/// The samples are prefiltered by c = s - (1/6) Σ δᵢ² s, so that the spline reproduces cubics. Its value has an error
/// of O(h⁴), its gradient of O(h³), its Hessian of O(h²). (Without the prefilter the surface would shrink by h² κ/6 at
/// a curvature κ.) The result is a distance where |d| < `reach`, the half width minus kSplineSupport. Beyond that it
/// levels off at the background value.
Sdf sdfOf(const LevelSet& levelSet);

} // namespace curlew
