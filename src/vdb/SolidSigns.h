// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/vdb/GridTypes.h"

namespace curlew {

/// In voxels: signs are determined individually for voxels closer than this to a surface; other voxels inherit them.
inline constexpr double kNearSurface = 1.5;

/// Extends signs that are known within kNearSurface to the rest of the band. Each voxel takes the sign of its neighbour
/// closest to the surface, step by step, since no surface lies between the two.
void spreadSigns(openvdb::FloatGrid& grid, const Monitor& monitor);

/// Returns whether all neighbouring voxels agree in sign unless the surface can pass between them. It cannot if the sum
/// of their distances exceeds the distance between them.
bool signsAgree(const openvdb::FloatGrid& grid, const Monitor& monitor);

} // namespace curlew
