// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/Openvdb.h"

namespace curlew {

/// Returns the active voxels of a grid, with active tiles expanded to voxels. Throws ValueError if OpenVDB does not
/// convert this type of grid to a mask, and ResourceError if the mask would not fit in memory.
openvdb::MaskTree::Ptr activeVoxels(const openvdb::GridBase& grid);

} // namespace curlew
