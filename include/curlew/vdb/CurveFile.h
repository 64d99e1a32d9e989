// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Curves.h"
#include "curlew/vdb/PointFile.h"

namespace curlew {

// Curves in files. `length` below is Curves::along: of curves by time it is called `time`. f and g are left out where
// the curves have none. All throw ValueError where the arrays of the curves differ in length, and FileError as
// writeAtomically.

/// Writes binary little-endian PLY: vertices of float x, y, z, speed, f, g, length and int curve (the seed's id), and
/// edges between them, that of a closed curve's end and beginning included. Throws ValueError if an id does not fit in
/// 32 bits, or the number of a vertex.
void writePly(const std::filesystem::path& path, const Curves& curves);

/// Writes the curves as the polylines (`l`) of an .obj, closed ones with their first vertex again at the end, single
/// points as `p`. It holds nothing but positions.
void writeObj(const std::filesystem::path& path, const Curves& curves);

/// Writes curve,vertex,closed,x,y,z,vx,vy,vz,speed,f,g,length with a header line, a line for each vertex, and as many
/// digits as it takes to read the same number again.
void writeCsv(const std::filesystem::path& path, const Curves& curves);

/// The vertices as OpenVDB points with the attributes P, v, id (their number, from 0), curve (the seed's id), vertex
/// (from 0 for each curve), closed (0 or 1), speed, f, g and length. Options and errors are those of pointGrid() for
/// particles; all vertices have to be finite.
openvdb::points::PointDataGrid::Ptr pointGrid(const Curves& curves,
                                              const PointGridOptions& options = {.name = "curves"});

} // namespace curlew
