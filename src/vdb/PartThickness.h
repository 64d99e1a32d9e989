// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/vdb/GridTypes.h"
#include "curlew/vdb/MeshFile.h"

namespace curlew {

/// How thin the parts of a solid are, as fractions of its surface.
struct PartThickness {
    double thin = 0;  ///< Thinner than kThinVoxels.
    double below = 0; ///< Thinner than a voxel.
    /// World units: 95 % of the thin parts, by area, are at least that thick. 0 if there are none.
    double thinnest = 0;
};

/// Measures the thickness of a solid below up to about 20,000 positions on its surface, evenly spread: the length of a
/// ray that enters the solid along the normal, up to the face where it leaves. Faces inside the solid are ignored.
/// `grid` is the level set of the mesh. Throws ResourceError and Interrupted.
PartThickness partThickness(const Mesh& mesh, const openvdb::FloatGrid& grid, const Monitor& monitor);

} // namespace curlew
