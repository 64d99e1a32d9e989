// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Snap.h"
#include "curlew/vdb/LevelSet.h"

namespace curlew {

/// Moves particles onto the closest point of the surface of a level set (sdfOf), if it is at most `reach` world units
/// away. Other particles stay where they are. Starts at the nearest vertex of the surface's mesh (levelSetToMesh),
/// which needs no wide band. From there, Newton steps slide the point along the surface and onto the spline, to within
/// `tolerance` world units. Near
/// the medial axis the result may be only a local minimum of the distance. Velocities and tracks are dropped. Throws
/// ValueError if the reach or the tolerance is not positive.
SnapResult snapToLevelSet(const LevelSet& levelSet, Points& particles, double reach, double tolerance,
                          const Monitor& monitor = {});

} // namespace curlew
