// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Domain.h"
#include "curlew/vdb/GridTypes.h"

#include <string>

namespace curlew {

/// Samples a field at the centres of the active voxels of `where`. The result has the same bytes for any number of
/// threads.
std::shared_ptr<openvdb::FloatGrid> sampledGrid(const ScalarField& field, const openvdb::GridBase& where,
                                                const std::string& name, const Monitor& monitor = {});

/// Makes a fog volume of the domain on the active voxels of `where`: 1 on the flow's side of the wall, falling to 0
/// over the last two voxels before the wall.
std::shared_ptr<openvdb::FloatGrid> densityGrid(const Domain& domain, const openvdb::GridBase& where,
                                                const Monitor& monitor = {});

/// Returns a grid of float or double vectors as floats: the same grid if it has floats already, else a copy of its
/// active values. Returns null for a grid of another type.
std::shared_ptr<const openvdb::Vec3SGrid> vectorsOf(const std::shared_ptr<const openvdb::GridBase>& grid);

/// Returns one component of a vector grid, at the same voxels.
std::shared_ptr<openvdb::FloatGrid> componentOf(const openvdb::Vec3SGrid& grid, int component, const std::string& name);

} // namespace curlew
