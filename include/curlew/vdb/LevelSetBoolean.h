// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/LevelSet.h"

#include <array>
#include <string_view>

namespace curlew {

enum class Boolean {
    unite,     ///< Both together.
    intersect, ///< What they share.
    subtract,  ///< The first without the second.
};

/// Two solids as one, by OpenVDB's csg tools, on the grid of the first; if the second has another grid, it is made anew
/// from its mesh in voxels of that size, or from polygons of its surface. The band is the wider of theirs.
///
/// The smaller or larger of two distances is no distance where the closest point has been cut away. There, beside the
/// edges where the surfaces meet, values come from OpenVDB's fast sweeping (first order: off by a third of a voxel at
/// most around an edge of 133 degrees, by one around a sharp one of 47); all others, and the surface itself, stay
/// exactly as they are. If both have meshes, their union is the solid of the mesh of both instead (vdb/MeshSolid.h),
/// with exact distances, and the result has that mesh; other results have none.
///
/// Throws ValueError if nothing is left; Interrupted. The result does not depend on the number of threads.
LevelSet combined(const LevelSet& first, const LevelSet& second, Boolean operation, const Monitor& monitor = {});

/// A shape as a level set with voxels like those of `like`, where the box of that and a band around it is; the shape's
/// own box if that is smaller. Throws ValueError if nothing of it is there.
LevelSet sampledShape(const Sdf& shape, const LevelSet& like, const Monitor& monitor = {});

/// A level set turned, moved and scaled alike along all axes, with its mesh: values stay distances.
LevelSet placed(const LevelSet& levelSet, const Placement& placement);
/// A mesh turned, moved and scaled. Faces keep their sides.
Mesh placed(const Mesh& mesh, const Placement& placement);
/// A grid turned, moved and scaled, by its transform; vectors that follow its type (velocities do) turn with it. Throws
/// ValueError if a staggered grid would be turned: its components are those along its axes.
openvdb::GridBase::Ptr placed(const openvdb::GridBase& grid, const Placement& placement);

} // namespace curlew
