// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/track/Points.h"
#include "curlew/vdb/HostProfile.h"

#include <openvdb/points/PointDataGrid.h>

#include <filesystem>
#include <string>
#include <vector>

namespace curlew {

struct PointGridOptions {
    double voxelSize = 0;        ///< World units, at least 1.5e-5; 0: about 8 particles share an occupied voxel.
    std::string name = "points"; ///< Of the grid.
    std::string velocity = std::string(kHostProfiles.front().pointVelocity); ///< Of the velocity attribute.
};

/// The particles as OpenVDB points with the attributes that hosts expect: P, `id` (32 bits), and of those that the
/// particles have: `v` (units per second), `age` and `life` (seconds), `fade` (0 to 1), and the track `f`, `g`, all as
/// float. P is kept to within 2⁻²⁵ voxels. The same particles give the same grid for any number of threads. Throws
/// ValueError if the arrays differ in length, a position is not finite, an id does not fit in 32 bits, or the voxel
/// size is unusable for these positions.
openvdb::points::PointDataGrid::Ptr pointGrid(const Points& particles, const PointGridOptions& options = {});

/// The points of a grid in world units, with their velocity (under the name of any host profile) if they have one, and
/// with `age`, `life`, `fade`, `f` and `g` where those are floats. With an `id` attribute (32 or 64 bits) they come
/// sorted by it; otherwise they are numbered from 0 in the order of the grid. Throws ValueError if an attribute is
/// missing from a part of the grid, or P, id or the velocity has an unexpected type; ResourceError if the points do not
/// fit the memory (a leaf whose points all have the same values takes a few bytes in a file, whatever their number);
/// Interrupted once the monitor says so.
Points pointsOf(const openvdb::points::PointDataGrid& grid, const Monitor& monitor = {});

/// Points of a file, and what else it has.
struct PointTable {
    Points points;
    std::vector<std::string> skipped; ///< Columns that are none of ours.
};

/// Reads what writePly() and writeCsv() below write, and the points of any .ply (text or binary, of either byte order)
/// or .csv with a column for each of x, y and z; vx, vy, vz, id, age, life, fade and f, g are taken where they are.
/// Without an id points are numbered from 0. Writing them again gives the same bytes. Throws FileError, naming the
/// file, if it is missing, damaged or of another kind, holds curves, has only a part of vx, vy, vz or of f, g, a
/// position that is not finite, or an id that is no whole number up to 2⁵³; ResourceError if they would not fit into
/// memory.
PointTable readPoints(const std::filesystem::path& path);

/// Whether a .ply has faces, by its header. Throws FileError if it cannot be read; false if it is no PLY.
bool plyHasFaces(const std::filesystem::path& path);

/// Writes binary little-endian PLY: float x, y, z; float vx, vy, vz; int id; float age, life, fade, f, g: all but
/// position and id if the particles have them. Throws ValueError if the arrays differ in length or an id does not fit
/// in 32 bits, FileError as writeAtomically.
void writePly(const std::filesystem::path& path, const Points& particles);

/// Writes the same as text, x,y,z[,vx,vy,vz],id[,age][,life][,fade][,f,g], with a header line and 9 significant digits.
/// Throws as writePly, but any id fits.
void writeCsv(const std::filesystem::path& path, const Points& particles);

} // namespace curlew
