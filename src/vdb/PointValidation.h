// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "VdbCursor.h"

namespace curlew {

/// Size of a grid of points in memory.
struct PointSizes {
    double points = 0; ///< Number of points.
    double bytes = 0;  ///< Bytes of OpenVDB's arrays.
};

/// Checks everything after the topology of a grid of points with `leaves` leaves: the descriptors, the sizes of all
/// arrays against each other, the pages against the sums of the arrays in them, and the headers of all compressed data.
/// `version` is the format version of the file. Leaves the cursor at the end of the grid. Throws FileError if anything
/// is inconsistent, since OpenVDB 10.0 would then read outside its arrays or end the program.
PointSizes validatePoints(VdbCursor& cursor, uint64_t leaves, uint32_t version);

} // namespace curlew
