// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Snap.h"
#include "curlew/vdb/LevelSet.h"

namespace curlew {

/// Moves particles onto the closest point of the surface of a level set (sdfOf), if it is at most `reach` world units
/// away. Other particles stay where they are. Each starts at the nearest vertex of the mesh of the surface
/// (levelSetToMesh), for which the narrow band need not be wide. From there, Newton steps slide it along the surface
/// and onto the spline, to within `tolerance` world units. Near the medial axis, the result may be only a local minimum
/// of the distance. Velocities and tracks are dropped. Throws ValueError if the reach or the tolerance is not positive,
/// or if the level set has no surface.
SnapResult snapToLevelSet(const LevelSet& levelSet, Points& particles, double reach, double tolerance,
                          const Monitor& monitor = {});

} // namespace curlew
