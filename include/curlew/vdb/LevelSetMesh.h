// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/LevelSet.h"

namespace curlew {

/// The surface of a level set as a mesh of quads, by OpenVDB's volumeToMesh; its faces run counter-clockwise as seen
/// from outside. With an adaptivity above 0, flat parts get larger faces, and triangles: 1 takes away the most.
/// Throws ValueError for an adaptivity that is not between 0 and 1, and where there is no surface.
Mesh levelSetToMesh(const LevelSet& levelSet, double adaptivity = 0);

} // namespace curlew
