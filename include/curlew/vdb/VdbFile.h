// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"

#include <openvdb/Grid.h>
#include <openvdb/MetaMap.h>

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace curlew {

/// How the values that a file keeps are packed. Inactive ones are always left out.
enum class Codec {
    automatic, ///< For each grid: blosc where it saves more than half, which are the fog volumes (a third or less is
               ///< left of them, their inside being constant); none for all others. Velocities pack to 92 % to 94 %,
               ///< distances and points to 84 % to 93 %, and writing takes up to 3 times as long with blosc, 10 to 30
               ///< times with zip.
    none,
    zip, ///< From OpenVDB it leaves level sets, fog volumes and points at their size.
    blosc
};

struct VdbWriteOptions {
    /// 16-bit floats for every grid of real numbers or vectors (beyond ±65504 they become infinite). Otherwise a grid
    /// is written as its own saveFloatAsHalf() says.
    bool half = false;
    Codec codec = Codec::automatic;
};

/// All grids of a .vdb file, in the order of the file and wholly in memory. Grids that share a tree in the file share
/// it here. Throws FileError, naming the file, if it is missing, empty, cut short, damaged, not a .vdb file, older than
/// OpenVDB 3 or newer than this OpenVDB, or if it holds a type of grid that this program does not know; a file of
/// writeVdb() is damaged if a single byte of it has changed since. Throws ResourceError if the grids do not fit the
/// memory, Interrupted once the monitor says so. Safe to call from several threads.
std::vector<openvdb::GridBase::Ptr> readVdb(const std::filesystem::path& path, const Monitor& monitor = {});

/// The same of a file that is in memory; `path` is its name in messages.
std::vector<openvdb::GridBase::Ptr> readVdbBytes(std::string_view bytes, const std::filesystem::path& path,
                                                 const Monitor& monitor = {});

/// What a grid is used as. A grid of points may hold curves (see CurveFile.h): its header does not say so.
enum class GridKind {
    levelSet,
    fogVolume,
    velocity, ///< Vectors of three floats, collocated or staggered.
    points,
    other
};

struct GridInfo {
    std::string name; ///< As the grid's getName().
    std::string type; ///< As the grid's type(), such as "Tree_float_5_4_3".
    GridKind kind;
};

/// What the grids of a .vdb file are, in the order of the file, by their headers alone. If the file was written without
/// offsets between its grids, all of it is read. Throws FileError as readVdb(), but damage in what is not read goes
/// unnoticed. Safe to call from several threads.
std::vector<GridInfo> vdbContents(const std::filesystem::path& path);

/// Writes the grids as one .vdb file: whole or not at all (see writeAtomically). The same grids, metadata and options
/// give the same bytes, for the UUID in the file is made from its content. Grids may share a name or a tree. The grids
/// themselves are not changed. A `creator` that begins with "Houdini", of the file or of a grid, is left out: Blender
/// would turn the axes of such a file.
/// Throws ValueError for a null grid, FileError if the file cannot be written and Interrupted once `cancelled` says so.
void writeVdb(const std::filesystem::path& path, const std::vector<openvdb::GridBase::ConstPtr>& grids,
              const openvdb::MetaMap& fileMetadata = {}, const VdbWriteOptions& options = {},
              const std::function<bool()>& cancelled = {});

} // namespace curlew
