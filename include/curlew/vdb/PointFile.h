#pragma once

#include "curlew/track/Particles.h"

#include <openvdb/points/PointDataGrid.h>

#include <filesystem>
#include <string>

namespace curlew {

/// The particles as OpenVDB points with the attributes that Houdini and Blender expect: P, `v` (if the particles have a
/// velocity; float, units per second) and `id` (32 bits). Tracks are not kept.
/// `voxelSize`, in world units, is at least 1.5e-5; 0 chooses it so that about 8 particles share an occupied voxel. P
/// is kept to within 2⁻²⁵ voxels. The same particles give the same grid for any number of threads. Throws ValueError if
/// the arrays differ in length, a position is not finite, an id does not fit in 32 bits, or the voxel size is unusable
/// for these positions.
openvdb::points::PointDataGrid::Ptr pointGrid(const Particles& particles, double voxelSize = 0,
                                              const std::string& name = "points");

/// The points of a grid in world units, with `v` if they have one. With an `id` attribute (32 or 64 bits) they come
/// sorted by it; otherwise they are numbered from 0 in the order of the grid.
/// Throws ValueError if an attribute is missing from a part of the grid or has an unexpected type.
Particles particlesOf(const openvdb::points::PointDataGrid& grid);

/// Writes binary little-endian PLY: float x, y, z, float vx, vy, vz if there is a velocity, int id.
/// Throws ValueError if the arrays differ in length or an id does not fit in 32 bits, FileError as writeAtomically.
void writePly(const std::filesystem::path& path, const Particles& particles);

/// Writes x,y,z[,vx,vy,vz],id with a header line and 9 significant digits. Throws as writePly, but any id fits.
void writeCsv(const std::filesystem::path& path, const Particles& particles);

} // namespace curlew
