// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/GridTypes.h"
#include "curlew/vdb/VdbFile.h"

namespace curlew {

// NanoVDB's .nvdb format (openvdb/nanovdb, format version 32), which GPU renderers read.

/// Writes grids of float, double, int32, int64 and vec3s. `half` stores grids of floats with 16 bits per value,
/// quantized between the minimum and the maximum of each 8 x 8 x 8 voxels (Fp16); vectors keep 32 bits, since NanoVDB
/// 32 has no smaller ones. Codec::automatic compresses nothing, so that any reader can map the file. The same grids and
/// options give the same bytes. The format has names, classes and transforms of grids, but no metadata. Writes
/// atomically. Throws ValueError if there are no grids, if a grid has no active voxels, is of another type or has a
/// transform that is not linear; ResourceError if the converted grids would not fit in memory; FileError and
/// Interrupted as writeAtomically() does.
void writeNano(const std::filesystem::path& path, const std::vector<std::shared_ptr<const openvdb::GridBase>>& grids,
               const VdbWriteOptions& options = {}, const std::function<bool()>& cancelled = {});

/// Reads all grids of the types above, and of 4, 8 and 16 bits per value, in the order of the file. Throws FileError,
/// naming the file, if it is missing, damaged, not a .nvdb, of another major version, or holds a grid of another type;
/// ResourceError if the grids do not fit in memory. All offsets within the file are checked. Compressed data is
/// unpacked by Blosc and zlib.
std::vector<std::shared_ptr<openvdb::GridBase>> readNano(const std::filesystem::path& path,
                                                         const Monitor& monitor = {});

/// Lists the grids of a .nvdb file from their headers. Throws FileError as readNano() does.
std::vector<GridInfo> nanoContents(const std::filesystem::path& path);

} // namespace curlew
