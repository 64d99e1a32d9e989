// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/field/ScalarField.h"
#include "curlew/field/Shapes.h"
#include "curlew/vdb/GridTypes.h"

namespace curlew {

/// Returns a scalar grid (float or double: a density, a temperature, a level set, …) as a field in world space: the C²
/// tricubic B-spline through its values with fourth-order accuracy. Beyond the grid's voxels it is the value of the
/// tile there or the background. Throws ValueError if the grid is of another type, has no active voxel, has voxels that
/// are not cubes, values that are not finite, or indices within 64 of the limits of int; ResourceError if there is not
/// enough memory.
ScalarField gridField(const openvdb::GridBase& grid, const Monitor& monitor = {});

/// The voxels of bakedGrid().
struct BakeOptions {
    Box box;          ///< Its edges are rounded to whole voxels. A period of a field gives a grid that tiles.
    double voxel = 0; ///< Voxel size, world units; 0: from `dim`.
    int dim = 128;    ///< Number of voxels along the longest edge of the box.
};

/// Samples a field at the centres of the voxels of a box. Regions of equal values become tiles. The result has the same
/// bytes for any number of threads. Throws ValueError if the box is infinite or empty, ResourceError if there is not
/// enough memory.
std::shared_ptr<openvdb::FloatGrid> bakedGrid(const ScalarField& field, const BakeOptions& options,
                                              const std::string& name, const Monitor& monitor = {});

} // namespace curlew
