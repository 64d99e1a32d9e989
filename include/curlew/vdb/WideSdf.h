// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/LevelSet.h"

namespace curlew {

/// Returns the level set as a C² signed distance that is valid up to `distance` world units from the surface.
///
/// Up to 20 voxels, this is sdfOf() of a widened() band. Beyond that, bands with voxels three times as large, and again
/// three times as large, continue the distance, so a layer that is wide in voxels takes seconds instead of minutes. The
/// distances of two bands are blended over the outer two thirds of the finer one. At the surface, value, gradient and
/// Hessian are those of the finest band; away from it, the error is about a hundredth of the distance where the
/// distance is smooth, and a quarter of a (larger) voxel at its kinks, the points that are equally far from two parts
/// of the surface. At each position, one spline is evaluated.
///
/// Throws as widened() does. A surface that larger voxels do not resolve, such as a thin plate, gets one wide band.
Sdf sdfUpTo(const LevelSet& levelSet, double distance, const Monitor& monitor = {});

} // namespace curlew
