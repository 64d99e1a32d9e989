// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/ScalarField.h"
#include "curlew/vdb/GridTypes.h"

namespace curlew {

/// Returns the tricubic B-spline through the values of a narrow band, as sdfOf() does for a level set. Beyond the
/// leaves of the grid it is the background value.
ScalarField splineOf(std::shared_ptr<const openvdb::FloatGrid> grid);

} // namespace curlew
