// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/vdb/GridTypes.h"

#include <filesystem>

namespace curlew {

// Writers of the vector fields of game engines: a value for each voxel of the box around the active voxels, x fastest.
// The grid's axes may be permuted or mirrored axes of the world (HostConversion.h). If they are others, or if the grid
// has more voxels along an axis than the format allows, it is resampled: the box then has cubes along the world's axes,
// of the size of the grid's voxels or as large as the format requires, and beyond the grid's voxels the background.
// Values come from OpenVDB's trilinear sampler; a cube larger than a voxel gets the mean over several samples.
// Staggered grids are averaged to voxel centres first. All functions write atomically and throw ValueError if the grid
// has no active voxels or a value that is not finite; ResourceError if the box would not fit in memory; FileError as
// writeAtomically() does. They do not convert axes or units: neither format records them.

/// The box of a vector field in world units, from the outer faces of its first voxels to those of its last.
struct FieldBox {
    openvdb::Coord size;
    openvdb::Vec3d lower, upper;
    bool resampled = false; ///< Whether the voxels of the box are not those of the grid.
};

constexpr int kMaxFgaSize = 128;      ///< Voxels along an axis; Unreal refuses more (VectorFieldFactory.cpp).
constexpr float kMaxFgaValue = 65504; ///< Unreal stores 16-bit floats.

/// Writes an .fga (fluid grid ASCII), as Unreal imports it: text, comma-separated numbers. First the number of voxels
/// along x, y and z, then the lower and the upper corner of the box, then the vectors. Throws ValueError if a component
/// exceeds kMaxFgaValue.
FieldBox writeFga(const std::filesystem::path& path, const openvdb::Vec3SGrid& grid, const Monitor& monitor = {});

/// Writes a .vf, version 1 (github.com/peeweek/VectorFieldFile): VF_V for vectors or VF_F for a grid of floats, three
/// 16-bit sizes, then 32-bit floats, little-endian. The format has no box: the caller tells the user where it is.
/// Throws ValueError for other types of grids.
FieldBox writeVf(const std::filesystem::path& path, const openvdb::GridBase& grid, const Monitor& monitor = {});

} // namespace curlew
