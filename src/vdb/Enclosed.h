// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/Openvdb.h"

namespace curlew {

/// Returns whether a level set is negative anywhere, by more than the rounding errors of a flat surface.
inline bool enclosesSomething(const openvdb::FloatGrid& grid) {
    const auto depth = static_cast<float>(1e-3 * grid.voxelSize()[0]);
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf)
        for (auto value = leaf->cbeginValueOn(); value; ++value)
            if (*value < -depth) return true;
    return false;
}

} // namespace curlew
