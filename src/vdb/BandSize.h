// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/LevelSet.h"

namespace curlew {

/// A surface in voxels: its area and the edges of its box.
struct Extent {
    double area;
    openvdb::Vec3d size;
};

openvdb::BBoxd boxOf(const Mesh& mesh);
double areaOf(const Mesh& mesh); ///< World units.

Extent extentOf(const Mesh& mesh, double voxel);
Extent extentOf(const LevelSet& levelSet);

/// About how many voxels lie within `halfWidth` voxels of a surface.
double samplesInBand(const Extent& surface, double halfWidth);

/// Throws ResourceError unless a band can be widened to `halfWidth` voxels in reasonable memory and time.
void requireBand(const Extent& surface, double halfWidth, double voxel);

} // namespace curlew
