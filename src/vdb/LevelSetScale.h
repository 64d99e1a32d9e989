// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/Openvdb.h"

#include <openvdb/tools/ChangeBackground.h>

namespace curlew {

/// Multiplies the distances of a level set by a factor above 0.
inline void scaleDistances(openvdb::FloatGrid& grid, float factor) {
    const float background = grid.background();
    for (auto value = grid.beginValueOn(); value; ++value) value.setValue(factor * *value);
    openvdb::tools::changeLevelSetBackground(grid.tree(), factor * background);
}

} // namespace curlew
