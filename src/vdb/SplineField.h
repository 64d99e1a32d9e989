// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/ScalarField.h"
#include "curlew/vdb/GridTypes.h"
#include "curlew/vdb/LevelSet.h"

#include <span>

namespace curlew {

/// Returns the tricubic B-spline through the values of a narrow band, as sdfOf() does for a level set. Beyond the
/// leaves of the grid it is the background value.
ScalarField splineOf(std::shared_ptr<const openvdb::FloatGrid> grid);

/// Returns sdfOf() the first band, continued by the others. Each has SplineRefinement::kRatio times as large voxels as
/// the one before, on the same lattice. Its distances must be valid from the surface to two of its voxels beyond the
/// reach of the one before.
Sdf sdfOfBands(std::span<const LevelSet> bands);

} // namespace curlew
