// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/LevelSet.h"

namespace curlew {

/// Area of a surface, and edge lengths of its box, in voxels.
struct Extent {
    double area;
    openvdb::Vec3d size;
};

openvdb::BBoxd boxOf(const Mesh& mesh);
double areaOf(const Mesh& mesh); ///< In world units.

/// Returns the distance between neighbouring float numbers at the coordinate of the mesh that is farthest from 0: the
/// resolution of its positions.
double spacingOf(const Mesh& mesh);
/// The largest spacing that a level set of a mesh allows, in voxels: positions are then off by at most an eighth of a
/// voxel along each axis.
inline constexpr double kMaxSpacing = 0.25;

Extent extentOf(const Mesh& mesh, double voxel);
Extent extentOf(const LevelSet& levelSet);

/// Estimates the number of voxels within `halfWidth` voxels of a surface.
double samplesInBand(const Extent& surface, double halfWidth);

/// Estimates the memory for making a level set with a band of `halfWidth` voxels, in bytes: the values, the face
/// indices, and copies during OpenVDB's conversion. Leaves are 8 voxels wide, so they reach about half a leaf beyond
/// the band.
double bandBytes(const Extent& surface, double halfWidth);

/// Throws ResourceError if widening a band to `halfWidth` voxels would take too much memory or time.
void requireBand(const Extent& surface, double halfWidth, double voxel);

} // namespace curlew
