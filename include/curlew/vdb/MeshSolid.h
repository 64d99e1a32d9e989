// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/LevelSet.h"

namespace curlew {

/// In voxels: where a solid is thinner, the spline of its level set may not be accurate to half a voxel, and a film may
/// have gaps. At this thickness, the spline is off by at most 0.1 voxels (measured on rotated plates, square rods and a
/// hollow ball), and by at most 0.24 at the edges and corners of thick bodies. Flat films thinner than 1.5 voxels
/// have gaps. They cover up to 1 % of the film's area at a thickness of 1.2 voxels, 9 % at 1, half at 0.8, all at 0.6.
inline constexpr double kThinVoxels = 3;

/// Properties of a mesh, found while it was converted to a level set.
struct SolidFigures {
    size_t boundaryEdges = 0;   ///< Edges with a face on one side only.
    size_t duplicateFaces = 0;  ///< Triangles dropped because others have the same vertices.
    size_t degenerateFaces = 0; ///< Faces with fewer than three distinct vertices; they are ignored.
    size_t reversedFaces = 0;   ///< Triangles that ran against their neighbours; they are treated as if flipped.
    size_t turnedShells = 0;    ///< Closed parts that were reversed but reach out of the others; treated as if flipped.
    bool turned = false;        ///< The faces run clockwise as seen from outside; they are treated as if flipped.
    /// The mesh is closed and consistently oriented, and no part of it lies inside. Winding numbers were not needed.
    bool clean = true;
    double undecided = 0; ///< Fraction of the voxels near the mesh where 1/4 < |w| < 3/4.
    double hidden = 0;    ///< Fraction of the mesh's area that does not bound the solid.
    /// Closed shells inside others that bound nothing, since their faces point outward as those of the shells around
    /// them do: their number, their faces, and their volume in cubic world units.
    size_t filledShells = 0, filledFaces = 0;
    double filledVolume = 0;
    double thin = 0; ///< Fraction of the surface where the solid is thinner than kThinVoxels.
    double missing =
        0;             ///< Fraction of the surface where it is thinner than a voxel, so that the level set may lack it.
    double enough = 0; ///< Voxel size at which 95 % of the thin parts are kThinVoxels thick; 0 if there are none.
    double meanThickness = 0; ///< 2 * volume / area of the solid, in voxels.
};

/// A level set of a mesh, and the properties of that mesh.
struct MeshSolid {
    LevelSet levelSet;
    SolidFigures figures;
};

/// Converts any mesh to a level set of its solid: the points where its winding number w satisfies |w| > 1/2
/// (WindingNumber.h), and those inside its closed parts alone, which open sheets beside or across them do not change.
///
/// Holes, overlapping or nested parts, unconnected triangles, duplicate and degenerate faces and inconsistent
/// orientation are all allowed. A shell inside another is a cavity if its faces point inward, and is ignored otherwise.
/// Values are distances to the boundary of the solid: faces inside it do not count, and holes are closed by the surface
/// |w| = 1/2. Distances are exact within 3 voxels, except near faces that are cut by other faces or by the
/// surface across a hole. There the remaining part of the face ends within 0.4 voxels, the size of a piece, of the cut.
/// Farther out, around small faces, they are too large by up to 0.03 voxels (measured on four meshes).
///
/// If the mesh is closed, manifold and consistently oriented, the side of the closest face gives the sign (Bærentzen
/// and Aanæs 2005). Two checks confirm that: neighbouring voxels with no face between them must have the same sign, and
/// a part of the mesh may lie inside another only as a cavity. For other meshes, w is computed at all voxels
/// within 1.75 voxels of the mesh.
///
/// Points at the same position are joined. Of faces with the same vertices, one is kept; none is kept if equally many
/// run in either direction. If most faces of the mesh are such pairs, or if it has fewer boundary edges with them, they
/// are made to be seen from both sides, and one of each is kept. Of such pairs, those without which a closed part would
/// be open are kept as well. A closed part that is reversed and reaches out of the others, such as a mirrored eye, is
/// treated as if flipped.
///
/// A sheet, such as cloth or terrain, encloses nothing. With a thickness t, the solid consists of the points closer
/// than t/2 to the mesh.
///
/// Positions of a mesh are float, so they are coarse far from the origin. The mesh is refused if neighbouring float
/// numbers there are more than a quarter of a voxel apart.
///
/// Throws ValueError if the mesh has no faces or no extent, is too far from the origin, or encloses nothing at this
/// resolution, or if a size is not positive; ResourceError if the band would not fit in memory; Interrupted. The result
/// does not depend on the number of threads.
MeshSolid solidOf(std::shared_ptr<const Mesh> mesh, const SolidOptions& options, const Monitor& monitor = {});

/// Returns the largest SolidOptions::dim for a mesh: OpenVDB takes no voxels below 1.5e-5 world units.
int mostVoxels(const Mesh& mesh);

} // namespace curlew
