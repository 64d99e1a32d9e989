// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Curves.h"
#include "curlew/vdb/PointFile.h"

namespace curlew {

// Files of curves. `length` below stands for Curves::along; if the curves are stepped by time, its name is `time`. f
// and g are omitted if the curves have none. All functions throw ValueError if the arrays of the curves differ in
// length. Those that write a file throw FileError as writeAtomically() does, and Interrupted once `cancelled` returns
// true.

/// Reads the polylines (`l`) of an .obj, the edges of a .ply, or a .csv with the columns curve, x, y, z and, if there
/// is one, closed; other columns are ignored. In a .csv, consecutive rows with the same curve are one. A polyline of an
/// .obj whose last vertex is its first is closed.
///
/// The edges of a .ply are joined as by curvesOf(), and so are the lines of an .obj if each has two vertices, as
/// Blender writes edges. If the vertices of a .ply have the property `curve`, that is the id.
///
/// Velocities are zero, and the seed of a curve is its first vertex. Throws FileError, naming the file and the line, if
/// it is missing, damaged, of another kind or has no curves.
Curves readCurves(const std::filesystem::path& path);

/// Returns whether an .obj has polylines and no faces, a .ply has edges and no faces, or the first column of a .csv is
/// `curve`. Throws FileError if the file cannot be read.
bool holdsCurves(const std::filesystem::path& path);

/// Writes binary little-endian PLY: vertices with float x, y, z, speed, f, g, length and int curve (the seed's id), and
/// edges between consecutive vertices. A closed curve also has an edge from its last vertex to its first. Throws
/// ValueError if an id or the index of a vertex does not fit in 32 bits.
void writePly(const std::filesystem::path& path, const Curves& curves, const std::function<bool()>& cancelled = {});

/// Writes the positions of the curves as polylines (`l`) of an .obj. A closed curve repeats its first vertex at the
/// end. A curve with a single vertex becomes a point (`p`).
void writeObj(const std::filesystem::path& path, const Curves& curves, const std::function<bool()>& cancelled = {});

/// Writes a header line with curve,vertex,closed,x,y,z,vx,vy,vz,speed,f,g,length and one line per vertex. Numbers have
/// enough digits to be read back exactly.
void writeCsv(const std::filesystem::path& path, const Curves& curves, const std::function<bool()>& cancelled = {});

/// Converts the vertices to OpenVDB points with the attributes P, v, id (the index of the vertex, from 0), curve (the
/// seed's id), vertex (the index within its curve, from 0), closed (0 or 1), speed, f, g and length. Options and errors
/// are those of pointGrid() for particles. All vertices must be finite.
std::shared_ptr<openvdb::points::PointDataGrid> pointGrid(const Curves& curves,
                                                          const PointGridOptions& options = {.name = "curves"},
                                                          const Monitor& monitor = {});

} // namespace curlew
