// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/GridTypes.h"
#include "curlew/vdb/LevelSet.h"

#include <array>
#include <string_view>

namespace curlew {

enum class Boolean {
    unite,     ///< Union.
    intersect, ///< Intersection.
    subtract,  ///< Difference: the first minus the second.
};

/// Combines two solids by OpenVDB's CSG tools, on the grid of the first. If the second has another transform, it is
/// resampled: from its mesh if it has one, otherwise from polygons of its surface. The half width is the larger of the
/// two.
///
/// The minimum or maximum of two distances is not a distance where the closest point has been cut away. There, next to
/// the edges where the surfaces meet, values come from OpenVDB's fast sweeping (first order; error at most a third of a
/// voxel around an edge of 133 degrees, one voxel around a sharp edge of 47). All other values, and the surface itself,
/// stay exactly as they are.
///
/// The union of two meshes, neither of them a sheet, is made from both meshes together instead (vdb/MeshSolid.h), if
/// the first grid has the transform that solidOf() uses. It has exact distances and the joined mesh. All other results
/// have no mesh.
///
/// Throws ValueError if nothing is left, and Interrupted. The result does not depend on the number of threads.
LevelSet combined(const LevelSet& first, const LevelSet& second, Boolean operation, const Monitor& monitor = {});

/// Combine a level set with a shape, which is sampled on the grid of the level set: within its box if the result lies
/// there, otherwise as by sampledShape(). Throw as above and as sampledShape() does, but a shape that the difference
/// takes away may contain no voxel centre of the box.
LevelSet combined(const Sdf& first, const LevelSet& second, Boolean operation, const Monitor& monitor = {});
LevelSet combined(const LevelSet& first, const Sdf& second, Boolean operation, const Monitor& monitor = {});

/// Samples a shape as a level set with the voxels and the half width of `like`: within the shape's bounds, or within
/// the box of the active voxels of `like` if the shape is unbounded. Throws ValueError if the shape encloses no voxel
/// there, ResourceError if it has too many voxels or they do not fit in memory, and Interrupted.
LevelSet sampledShape(const Sdf& shape, const LevelSet& like, const Monitor& monitor = {});

/// Returns a level set, with its mesh, rotated, translated and scaled uniformly. Values stay distances. The mesh is
/// dropped if its positions, which are float, would be more than a quarter of a voxel apart there. All overloads throw
/// ValueError unless the scale is positive and the same along all axes.
LevelSet placed(const LevelSet& levelSet, const Placement& placement);
/// Returns a mesh rotated, translated and scaled. Its faces keep their orientation.
Mesh placed(const Mesh& mesh, const Placement& placement);
/// Returns a grid rotated, translated and scaled by its transform. Vectors (velocities) rotate with it, unless
/// followsSpace() is false for the grid (HostConversion.h): colours. The distances of a DoubleGrid scale if it is a
/// level set; a FloatGrid keeps its values, since the overload for level sets scales them. Throws ValueError if a
/// staggered grid would be rotated, since its components lie along its axes.
std::shared_ptr<openvdb::GridBase> placed(const openvdb::GridBase& grid, const Placement& placement);

} // namespace curlew
