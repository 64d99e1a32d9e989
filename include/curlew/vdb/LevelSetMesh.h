// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/GridTypes.h"
#include "curlew/vdb/LevelSet.h"

namespace curlew {

/// Converts the surface of a level set to a mesh of quads, by OpenVDB's volumeToMesh. Faces run counter-clockwise as
/// seen from outside. An adaptivity above 0 merges faces in flat parts into larger ones, some of them triangles; 1
/// merges the most. Throws ValueError if the adaptivity is not between 0 and 1, or if there is no surface.
Mesh levelSetToMesh(const LevelSet& levelSet, double adaptivity = 0);

/// Returns the same for any grid of class GRID_LEVEL_SET, whose values need not be distances; no faces if there is no
/// surface. Throws ValueError if the adaptivity is not between 0 and 1.
Mesh surfaceOf(const openvdb::FloatGrid& grid, double adaptivity);

} // namespace curlew
