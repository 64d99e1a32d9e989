// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "VdbCursor.h"

namespace curlew {

/// What the leaves of a grid of points will take in memory.
struct PointSizes {
    double points = 0; ///< Their number.
    double bytes = 0;  ///< Of OpenVDB's arrays.
};

/// Checks what follows the topology of a grid of points with that many leaves: the descriptors, the sizes of all arrays
/// against each other, the pages against the sums of the arrays in them, the headers of all that is packed. `version`:
/// of the file. Leaves the cursor at the end of the grid. Throws FileError if anything does not fit, as OpenVDB 10.0
/// would follow it out of its arrays or end the program.
PointSizes validatePoints(VdbCursor& cursor, uint64_t leaves, uint32_t version);

} // namespace curlew
