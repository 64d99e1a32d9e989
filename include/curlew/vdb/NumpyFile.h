// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/track/Curves.h"
#include "curlew/track/Points.h"
#include "curlew/vdb/GridTypes.h"

#include <filesystem>
#include <optional>
#include <vector>

namespace curlew {

// Writers of NumPy's .npy and .npz formats (numpy.org/doc/stable/reference/generated/numpy.lib.format.html), version
// 1.0, little-endian. numpy.load() reads the files without allow_pickle. All functions write atomically, throw
// FileError as writeAtomically() does and Interrupted once the monitor asks for it, and are safe to call from several
// threads.

/// The time that a file shows.
struct FrameTime {
    double frame = 1; ///< Number of the frame.
    double fps = 24;  ///< Frames per second.
};

struct NumpyOptions {
    bool deflate = false;               ///< Compresses the arrays of a .npz. Noise hardly shrinks.
    std::optional<FrameTime> time = {}; ///< Adds the arrays `frame` and `fps`, without dimensions, to a .npz.
};

/// Writes the particles. A .npz has an array for each attribute, with one row per particle: P (3 doubles, world units),
/// v (3 floats, world units per second), id (64-bit integers), age and life (floats, seconds), fade (float), f and g
/// (doubles). A .npy has one structured array with these fields. Attributes that the particles lack are omitted. Throws
/// ValueError if the arrays differ in length or a position or velocity is not finite, or for another extension.
void writeNumpy(const std::filesystem::path& path, const Points& particles, const NumpyOptions& options = {},
                const Monitor& monitor = {});

/// Writes the vertices of curves in the same way: P, v, f, g and length (time, if the curves are stepped by time). A
/// .npz also has start (n + 1 entries: curve k has the vertices start[k] … start[k+1]-1), id and closed, one per curve.
/// A .npy has the fields curve (index of the curve, from 0) and closed instead.
void writeNumpy(const std::filesystem::path& path, const Curves& curves, const NumpyOptions& options = {},
                const Monitor& monitor = {});

/// Writes grids as dense boxes: the values of all voxels, active or not, in the bounding box of the active voxels. For
/// a grid `vel`, a .npz has the arrays
///   vel            nx × ny × nz, or nx × ny × nz × 3 for vectors, in C order;
///   vel_transform  4 × 4 doubles that take the column [i, j, k, 1] of an array index to the world position of the
///                  voxel's centre;
///   vel_staggered  for vectors: whether component k lies on the lower face along axis k instead of at the centre.
/// A .npy holds the values of a single grid and nothing else. Grids without a name are called `grid`; equal names get a
/// number. Throws ValueError if a grid has no active voxels, is of another type than float, double, int32, int64, vec3s
/// and vec3d, has a value that is not finite or a transform that is not linear; ResourceError if the box would not fit
/// in memory.
void writeNumpy(const std::filesystem::path& path, const std::vector<std::shared_ptr<const openvdb::GridBase>>& grids,
                const NumpyOptions& options = {}, const Monitor& monitor = {});

} // namespace curlew
