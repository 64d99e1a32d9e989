// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Snap.h"
#include "curlew/vdb/LevelSet.h"

namespace curlew {

/// Moves particles onto the surface of a level set (sdfOf), to the nearest of its places, from any distance up to
/// `reach` world units; those farther away stay. OpenVDB finds the nearest sample of the surface, which needs no wide
/// band; from there Newton steps along the surface and onto the spline lead on. Particles end on the surface to within
/// `tolerance` world units. Those near the medial axis may end at a place that is nearest among its neighbours only.
/// Velocities and tracks are forgotten. Throws ValueError for a reach or tolerance that is not positive.
SnapResult snapToLevelSet(const LevelSet& levelSet, Points& particles, double reach, double tolerance,
                          const Monitor& monitor = {});

} // namespace curlew
