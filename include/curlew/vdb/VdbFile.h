#pragma once

#include <openvdb/Grid.h>
#include <openvdb/MetaMap.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <vector>

namespace curlew {

enum class Codec { none, zip, blosc };

struct VdbWriteOptions {
    /// 16-bit floats for every grid of real numbers or vectors (beyond ±65504 they become infinite). Otherwise a grid
    /// is written as its own saveFloatAsHalf() says.
    bool half = false;
    /// On top of leaving out inactive values, which is always done. Noise hardly shrinks (a dense 256³ velocity to 92 %
    /// at best), and none is 6 times as fast as blosc and 70 times as fast as zip.
    Codec codec = Codec::none;
};

/// All grids of a .vdb file, in the order of the file and wholly in memory. Grids that share a tree in the file share
/// it here. Throws FileError, naming the file, if it is missing, empty, cut short, damaged, not a .vdb file, older than
/// OpenVDB 3 or newer than this OpenVDB, or if it holds a type of grid that this program does not know. Safe to call
/// from several threads.
std::vector<openvdb::GridBase::Ptr> readVdb(const std::filesystem::path& path);

/// Writes the grids as one .vdb file: whole or not at all (see writeAtomically). The same grids, metadata and options
/// give the same bytes, for the UUID in the file is made from its content. Grids may share a name or a tree. The grids
/// themselves are not changed. A `creator` that begins with "Houdini", of the file or of a grid, is left out: Blender
/// would turn the axes of such a file.
/// Throws ValueError for a null grid, FileError if the file cannot be written and Interrupted once `cancelled` says so.
void writeVdb(const std::filesystem::path& path, const std::vector<openvdb::GridBase::ConstPtr>& grids,
              const openvdb::MetaMap& fileMetadata = {}, const VdbWriteOptions& options = {},
              const std::function<bool()>& cancelled = {});

/// A binary stream of an existing file that throws std::ios_base::failure if it ends before a read is complete.
/// Throws FileError if there is no such file, it is not a regular file, it cannot be opened or it is empty.
std::ifstream openToRead(const std::filesystem::path& path);

} // namespace curlew
