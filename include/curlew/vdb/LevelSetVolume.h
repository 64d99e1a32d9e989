// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/vdb/LevelSet.h"

namespace curlew {

/// Returns the volume inside the surface of sdfOf(), in cubic world units. Each eighth of a voxel near the surface
/// counts with the part that a plane at the distance of its centre would cut off. The values need not be distances, as
/// after advection. The volume of a ball with a radius of r voxels is too large by 1 / (16 r²) of it.
double volumeOf(const LevelSet& levelSet, const Monitor& monitor = {});

} // namespace curlew
