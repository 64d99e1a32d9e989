// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/LevelSetMesh.h"

#include "curlew/base/Error.h"
#include "curlew/base/Memory.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/format.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <utility>

namespace curlew {

Mesh surfaceOf(const openvdb::FloatGrid& grid, double adaptivity) {
    if (!(adaptivity >= 0 && adaptivity <= 1))
        throw ValueError(fmt::format("adaptivity {} must be between 0 and 1", adaptivity));
    Mesh mesh;
    openvdb::tools::volumeToMesh(grid, mesh.points, mesh.triangles, mesh.quads, 0.0, adaptivity);
    // OpenVDB's faces run clockwise as seen from outside, or counter-clockwise if the grid's axes are left-handed.
    if (!(grid.transform().baseMap()->determinant() > 0)) return mesh;
    for (auto& face : mesh.triangles) std::swap(face[0], face[2]);
    for (auto& face : mesh.quads) std::swap(face[1], face[3]);
    return mesh;
}

Mesh levelSetToMesh(const LevelSet& levelSet, double adaptivity) {
    // Signs and indices of the voxels in the band; for each voxel on the surface a point and a face, also in OpenVDB's
    // own arrays.
    const auto voxels = static_cast<double>(levelSet.grid->activeVoxelCount());
    requireMemory(
        voxels * (12 + 90 / (2 * static_cast<double>(levelSet.grid->background()) / levelSet.grid->voxelSize()[0])),
        fmt::format("the mesh of a level set of {:.2g} voxels", voxels), "use a coarser level set");
    Mesh mesh = surfaceOf(*levelSet.grid, adaptivity);
    if (mesh.faces() == 0) throw ValueError(fmt::format("level set '{}' has no surface", levelSet.grid->getName()));
    return mesh;
}

} // namespace curlew
