// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openvdb/openvdb.h>

namespace curlew {

/// The active voxels of a grid, active tiles as voxels. Throws ValueError for a type of grid that OpenVDB does not
/// convert to a mask.
openvdb::MaskTree::Ptr activeVoxels(const openvdb::GridBase& grid);

} // namespace curlew
