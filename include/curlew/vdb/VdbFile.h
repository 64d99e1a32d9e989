// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/vdb/GridTypes.h"

#include <openvdb/MetaMap.h>

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace curlew {

/// How values are compressed in a file. Inactive values are never stored.
enum class Codec {
    automatic, ///< Per grid: blosc for fog volumes, whose constant inside shrinks them to a third or less, and none for
               ///< all others. Blosc leaves 92 % to 94 % of velocities and 84 % to 93 % of distances and points.
               ///< Writing takes up to 3 times as long with blosc, and 10 to 30 times with zip.
    none,
    zip, ///< As OpenVDB uses it, zip does not shrink level sets, fog volumes and points.
    blosc
};

struct VdbWriteOptions {
    /// Writes every grid of real numbers or vectors as 16-bit floats (ValueError if one is beyond ±65504). If false,
    /// each grid's saveFloatAsHalf() decides.
    bool half = false;
    Codec codec = Codec::automatic;
};

/// Reads all grids of a .vdb file into memory, in the order of the file. Grids that share a tree in the file share it
/// here. Throws FileError, naming the file, if it is missing, empty, truncated, damaged, not a .vdb file, older than
/// OpenVDB 3 or newer than this OpenVDB, or if it holds an unknown type of grid. In a file that writeVdb() wrote, any
/// changed byte is detected as damage. Throws ResourceError if the grids do not fit in memory, and Interrupted once the
/// monitor asks for it. Safe to call from several threads.
std::vector<std::shared_ptr<openvdb::GridBase>> readVdb(const std::filesystem::path& path, const Monitor& monitor = {});

/// Reads a .vdb file that is already in memory; `path` names it in messages.
std::vector<std::shared_ptr<openvdb::GridBase>> readVdbBytes(std::string_view bytes, const std::filesystem::path& path,
                                                             const Monitor& monitor = {});

/// The use of a grid. A grid of points may hold curves (see CurveFile.h); its header does not tell.
enum class GridKind {
    levelSet,
    fogVolume,
    velocity, ///< Any grid of vectors, of floats or doubles: also colours.
    points,
    other
};

struct GridInfo {
    std::string name; ///< GridBase::getName().
    std::string type; ///< GridBase::type(), such as "Tree_float_5_4_3".
    GridKind kind;
};

/// Lists the grids of a .vdb file in the order of the file, from their headers alone. If the file has no offsets
/// between its grids, all of it is read. Throws FileError as readVdb() does, but does not notice damage in parts that
/// it does not read. Safe to call from several threads.
std::vector<GridInfo> vdbContents(const std::filesystem::path& path);

/// Writes the grids to one .vdb file, which appears complete or not at all (see writeAtomically). The same grids,
/// metadata and options give the same bytes: the UUID in the file is derived from its content. Grids may share a name
/// or a tree. The grids themselves are not changed. A `creator` that begins with "Houdini", of the file or of a grid,
/// is omitted, because Blender would rotate the axes of such a file. Throws ValueError if a grid is null, FileError if
/// the file cannot be written, and Interrupted once `cancelled` returns true.
void writeVdb(const std::filesystem::path& path, const std::vector<std::shared_ptr<const openvdb::GridBase>>& grids,
              const openvdb::MetaMap& fileMetadata = {}, const VdbWriteOptions& options = {},
              const std::function<bool()>& cancelled = {});

} // namespace curlew
