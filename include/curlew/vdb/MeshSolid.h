// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/LevelSet.h"

namespace curlew {

struct SolidOptions {
    double voxel = 0;     ///< Voxel size, world units; 0: from dim.
    int dim = 256;        ///< Voxels along the longest edge of the mesh's box, where no voxel size is given.
    double halfWidth = 3; ///< Of the narrow band, in voxels.
    double thickness = 0; ///< Above 0: the mesh is a sheet, of this thickness in world units, half on either side.
};

/// What a mesh was found to be when it became a level set.
struct SolidFigures {
    size_t boundaryEdges = 0;   ///< Edges with a face on one side only.
    size_t duplicateFaces = 0;  ///< Triangles that were dropped since others have the same corners.
    size_t degenerateFaces = 0; ///< Faces with fewer than three different corners, which count for nothing.
    bool turned = false;        ///< The faces run clockwise as seen from outside: they count as if turned.
    /// The mesh is closed, its faces agree on their sides, and none lies inside: winding numbers were not needed.
    bool clean = true;
    double undecided = 0; ///< Share of the voxels beside the mesh where 0.1 < |w| < 0.9.
    double hidden = 0; ///< Share of the mesh's area that does not bound the solid: it lies inside, or bounds nothing.
    double thin = 0;   ///< Share of the surface whose other side is closer than a voxel: the level set lacks it.
    double meanThickness = 0; ///< Twice the volume of the solid by the area of its surface, voxels.
};

/// A level set of a mesh, and what the mesh was found to be.
struct MeshSolid {
    LevelSet levelSet;
    SolidFigures figures;
};

/// The level set of the solid of any mesh: of where its winding number w is above 1/2 in size (WindingNumber.h).
///
/// Holes, parts that overlap or lie in each other, triangles that are not joined, duplicate and degenerate faces and
/// faces that run the wrong way are all allowed. A shell inside another is a cavity if its faces are turned inward, and
/// counts for nothing otherwise. Values are distances to the boundary of the solid: faces inside it do not count, and
/// holes are closed by the surface |w| = 1/2. They are exact but for faces that are cut by others, or by the surface
/// across a hole: kept pieces end there within the size of a piece, 0.4 voxels.
///
/// Distances are those of OpenVDB's meshToVolume, with what is too large corrected beyond 1.75 voxels. Where a mesh is
/// closed and clean, the side of the closest face is the sign (Bærentzen and Aanæs 2005). That is checked: no two
/// neighbours with no face between them may differ, and the parts of the mesh may not lie in each other but as
/// cavities. For other meshes w is computed at all voxels within 1.75 of the mesh. Points at the same position are one;
/// of faces with the same corners one counts, or none where as many run in either direction (all of them do in a mesh
/// that is made to be seen from both sides; then one does). A sheet, such as cloth or a terrain, encloses nothing; with
/// a thickness t the solid is where the mesh is closer than t/2.
///
/// Throws ValueError for a mesh without faces or extent and for one that encloses nothing at this resolution, and for
/// sizes that are not positive; ResourceError where the band would not fit the memory; Interrupted. The result does not
/// depend on the number of threads.
MeshSolid solidOf(std::shared_ptr<const Mesh> mesh, const SolidOptions& options, const Monitor& monitor = {});

} // namespace curlew
