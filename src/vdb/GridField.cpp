// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/GridField.h"

#include "DenseBox.h"
#include "SplineField.h"
#include "curlew/base/Error.h"
#include "curlew/base/Memory.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/ScalarGrids.h"

#include <fmt/format.h>
#include <openvdb/tools/Morphology.h>
#include <openvdb/tools/Prune.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace curlew {

namespace {

constexpr double kBytesPerVoxel = 4 * 11.0 * 11 * 11 / (8 * 8 * 8); // of the spline's blocks

/// Returns a copy as a grid of floats.
openvdb::FloatGrid::Ptr floatsOf(const openvdb::GridBase& grid) {
    if (grid.isType<openvdb::FloatGrid>()) return static_cast<const openvdb::FloatGrid&>(grid).deepCopy();
    if (grid.isType<openvdb::DoubleGrid>())
        return std::make_shared<openvdb::FloatGrid>(static_cast<const openvdb::DoubleGrid&>(grid));
    throw ValueError(fmt::format("grid '{}' has values of type {}; a field needs float or double", grid.getName(),
                                 grid.valueType()));
}

/// Returns the number of leaves within a distance of active voxels, in voxels along each axis.
size_t leavesAround(const openvdb::FloatTree& tree, int distance) {
    openvdb::MaskTree active(tree, false, true, openvdb::TopologyCopy()), reached;
    active.voxelizeActiveTiles();
    for (auto leaf = active.cbeginLeaf(); leaf; ++leaf) {
        openvdb::CoordBBox box;
        leaf->evalActiveBoundingBox(box);
        if (box.empty()) continue;
        box.expand(distance);
        const openvdb::Coord first = box.min() & ~7, last = box.max() & ~7;
        for (int i = first[0]; i <= last[0]; i += 8)
            for (int j = first[1]; j <= last[1]; j += 8)
                for (int k = first[2]; k <= last[2]; k += 8) reached.touchLeaf({i, j, k});
    }
    return reached.leafCount();
}

/// Throws ValueError if voxels are so far away that the coordinates of the leaves around them would overflow.
void checkCoordinates(const openvdb::GridBase& grid) {
    constexpr int kFarthest = std::numeric_limits<int>::max() - 64;
    const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
    for (int axis = 0; axis < 3; ++axis)
        if (box.min()[axis] < -kFarthest || box.max()[axis] > kFarthest)
            throw ValueError(fmt::format(
                "grid '{}' has voxels with the index {}; a field needs indices from -{} to {}", grid.getName(),
                box.max()[axis] > kFarthest ? box.max()[axis] : box.min()[axis], kFarthest, kFarthest));
}

void checkValues(const openvdb::FloatGrid& grid) {
    size_t bad = 0;
    for (auto value = grid.cbeginValueAll(); value; ++value) bad += !std::isfinite(*value); // all can be read
    if (bad > 0 || !std::isfinite(grid.background()))
        throw ValueError(fmt::format("grid '{}' has {} values that are not finite (NaN or infinite)", grid.getName(),
                                     std::max<size_t>(bad, 1)));
}

} // namespace

ScalarField gridField(const openvdb::GridBase& grid, const Monitor& monitor) {
    if (grid.activeVoxelCount() == 0)
        throw ValueError(fmt::format("grid '{}' has no active voxels; a field needs some", grid.getName()));
    if (!hasCubicVoxels(grid))
        throw ValueError(fmt::format("the voxels of grid '{}' are not cubes; resample it first", grid.getName()));
    checkCoordinates(grid);
    // Leaves for all active voxels, and for the voxels around them in which the spline still changes.
    constexpr int kSupport = 3;
    constexpr double kLeafVoxels = 8.0 * 8 * 8, kMaskBytes = 0.25; // a bit, and the tree above it
    const auto require = [&](double bytes) {
        requireMemory(bytes, fmt::format("a field from grid '{}'", grid.getName()), "use fewer voxels");
    };
    require((4 + kMaskBytes) * static_cast<double>(grid.activeVoxelCount()));
    const openvdb::FloatGrid::Ptr values = floatsOf(grid);
    checkValues(*values);
    require((4 + kBytesPerVoxel) * kLeafVoxels * static_cast<double>(leavesAround(values->tree(), kSupport)));
    monitor.check();
    values->tree().voxelizeActiveTiles();
    openvdb::tools::dilateActiveValues(values->tree(), kSupport, openvdb::tools::NN_FACE_EDGE_VERTEX,
                                       openvdb::tools::EXPAND_TILES);
    monitor.check();
    return splineOf(values);
}

openvdb::FloatGrid::Ptr bakedGrid(const ScalarField& field, const BakeOptions& options, const std::string& name,
                                  const Monitor& monitor) {
    const Vec3d size = options.box.size();
    const double longest = *std::max_element(size.c.begin(), size.c.end());
    if (!options.box.finite() || !(*std::min_element(size.c.begin(), size.c.end()) > 0))
        throw ValueError("the box to bake is empty or infinite; give box=");
    const double voxel = options.voxel > 0 ? options.voxel : longest / options.dim;
    openvdb::Coord last;
    double voxels = 1;
    for (int axis = 0; axis < 3; ++axis) {
        const double count = std::max(1.0, std::round(size[axis] / voxel));
        voxels *= count;
        if (!(count < 0x1p30)) throw ValueError(fmt::format("voxels of {:.3g} are too small for the box", voxel));
        last[axis] = static_cast<int>(count) - 1;
    }
    requireMemory(4.5 * voxels, fmt::format("{:.3g} voxels", voxels), "use larger voxels or a smaller box");
    const auto where = openvdb::FloatGrid::create();
    const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
    const Vec3d& lower = options.box.lower;
    transform->postTranslate({lower[0] + 0.5 * voxel, lower[1] + 0.5 * voxel, lower[2] + 0.5 * voxel});
    where->setTransform(transform);
    where->tree().denseFill(openvdb::CoordBBox({0, 0, 0}, last), 0.0f, true);
    openvdb::FloatGrid::Ptr baked = sampledGrid(field, *where, name, monitor);
    openvdb::tools::prune(baked->tree());
    return baked;
}

} // namespace curlew
