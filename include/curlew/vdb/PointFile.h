// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/track/Points.h"
#include "curlew/vdb/GridTypes.h"
#include "curlew/vdb/HostProfile.h"

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace curlew {

struct PointGridOptions {
    double voxelSize = 0;        ///< World units, at least 1.5e-5; 0: chosen so that an occupied voxel has about 8
                                 ///< particles.
    std::string name = "points"; ///< Name of the grid.
    std::string velocity = std::string(kHostProfiles.front().pointVelocity); ///< Name of the velocity attribute.
};

/// Converts particles to OpenVDB points with the attributes that hosts expect: P and `id` (32 bits), and those of the
/// following that the particles have: `v` (units per second), `age` and `life` (seconds), `fade` (0 to 1), and the
/// track `f`, `g`, all as float. P is accurate to 2⁻²⁵ voxels. The same particles give the same grid for any number of
/// threads. Throws ValueError if the arrays differ in length, a position is not finite, an id does not fit in 32 bits,
/// or the voxel size is unusable for these positions; Interrupted once the monitor asks for it.
std::shared_ptr<openvdb::points::PointDataGrid> pointGrid(const Points& particles, const PointGridOptions& options = {},
                                                          const Monitor& monitor = {});

/// Reads the points of a grid in world units. Reads the velocity if it has the name of any host profile, and `age`,
/// `life`, `fade`, `f` and `g` if they are floats. If there is an `id` attribute (32 or 64 bits), the points are sorted
/// by it; otherwise they are numbered from 0 in the order of the grid. Throws ValueError if an attribute is missing
/// from a part of the grid, or if P, id or the velocity has an unexpected type; ResourceError if the points do not fit
/// in memory (a leaf whose points all have the same values takes only a few bytes in a file, whatever their number);
/// Interrupted once the monitor asks for it.
Points pointsOf(const openvdb::points::PointDataGrid& grid, const Monitor& monitor = {});

/// The points of a file.
struct PointTable {
    Points points;
    std::vector<std::string> skipped; ///< Names of the columns that were ignored.
};

/// Reads the files that writePly() and writeCsv() below write, and the points of any .ply (text or binary, of either
/// byte order) or .csv with the columns x, y and z. The columns vx, vy, vz, id, age, life, fade and f, g are optional.
/// Without ids, points are numbered from 0. Writing the points again gives the same bytes. Throws FileError, naming the
/// file, if it is missing, damaged or of another kind, if it holds curves, if only some of vx, vy, vz or of f, g are
/// present, if a position is not finite, or if an id is not an integer of at most 2⁵³. Throws ResourceError if the
/// points would not fit in memory; Interrupted.
PointTable readPoints(const std::filesystem::path& path, const Monitor& monitor = {});

/// What the elements of a .ply make: a mesh if it has faces, else curves if it has edges.
enum class PlyContent { points, curves, mesh };

/// Returns what a .ply holds, according to its header; points if it is not a PLY. Throws FileError if the file cannot
/// be read.
PlyContent contentOfPly(const std::filesystem::path& path);

/// Writes binary little-endian PLY with float x, y, z, vx, vy, vz; int id; float age, life, fade, f, g. Everything but
/// position and id is omitted if the particles do not have it. Throws ValueError if the arrays differ in length or an
/// id does not fit in 32 bits, FileError as writeAtomically() does, and Interrupted once `cancelled` returns true.
void writePly(const std::filesystem::path& path, const Points& particles, const std::function<bool()>& cancelled = {});

/// Writes the same as text, x,y,z[,vx,vy,vz],id[,age][,life][,fade][,f,g], with a header line and 9 significant digits.
/// Throws as writePly() does, but ids may have 64 bits.
void writeCsv(const std::filesystem::path& path, const Points& particles, const std::function<bool()>& cancelled = {});

} // namespace curlew
