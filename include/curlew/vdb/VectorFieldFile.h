// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"

#include <openvdb/openvdb.h>

#include <filesystem>

namespace curlew {

// Writers of the vector fields of game engines: a value for each voxel of the box around the active voxels, x fastest.
// The grid's axes may be turned or mirrored (HostConversion.h), but must be those of the world. Staggered grids are
// averaged to voxel centres. All functions write atomically and throw ValueError if the grid has no active voxels, more
// voxels along an axis than the format allows, axes that are not those of the world, or a value that is not finite;
// ResourceError if the box would not fit in memory; FileError as writeAtomically() does. They do not convert axes or
// units: neither format records them.

/// The box of a vector field in world units, from the outer faces of its first voxels to those of its last.
struct FieldBox {
    openvdb::Coord size;
    openvdb::Vec3d lower, upper;
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
