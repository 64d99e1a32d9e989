// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Error.h"
#include "curlew/base/Memory.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/format.h>
#include <openvdb/tools/Dense.h>

#include <cmath>
#include <string>

namespace curlew {

/// Returns the name of a grid for messages.
inline std::string titleOf(const openvdb::GridBase& grid) {
    return grid.getName().empty() ? "the grid" : fmt::format("the grid '{}'", grid.getName());
}

/// Returns the bounding box of the active voxels. Throws ValueError if there are none, and ResourceError if an array of
/// `valueBytes` for each voxel of the box would not fit in memory.
inline openvdb::CoordBBox denseBoxOf(const openvdb::GridBase& grid, size_t valueBytes) {
    const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
    if (box.empty())
        throw ValueError(fmt::format("{} has no active voxels, so there is nothing to write", titleOf(grid)));
    const auto dim = [&](int axis) { return double(box.max()[axis]) - double(box.min()[axis]) + 1; };
    requireMemory(
        dim(0) * dim(1) * dim(2) * double(valueBytes),
        fmt::format("{} as a dense box of {:.0f} x {:.0f} x {:.0f} voxels", titleOf(grid), dim(0), dim(1), dim(2)),
        "use larger voxels or a smaller box, or write .vdb, which stores active voxels only");
    return box;
}

inline bool isFiniteValue(float value) { return std::isfinite(value); }
inline bool isFiniteValue(double value) { return std::isfinite(value); }
template <class T>
bool isFiniteValue(const openvdb::math::Vec3<T>& value) {
    return value.isFinite();
}
template <class T>
requires std::is_integral_v<T>
bool isFiniteValue(T) { return true; }

/// Throws ValueError if a value of a grid in an array is not finite.
template <class Dense>
void requireFinite(const openvdb::GridBase& grid, const Dense& dense) {
    for (size_t n = 0; n < dense.valueCount(); ++n)
        if (!isFiniteValue(dense.data()[n])) {
            const openvdb::Coord ijk = dense.offsetToCoord(n);
            throw ValueError(
                fmt::format("{} has a value that is not finite at voxel {},{},{}; other programs cannot "
                            "read it",
                            titleOf(grid), ijk[0], ijk[1], ijk[2]));
        }
}

/// Copies a grid to an array over the bounding box of its active voxels. Throws as denseBoxOf() does, and ValueError if
/// a value is not finite.
template <openvdb::tools::MemoryLayout Layout, class GridType>
auto denseCopy(const GridType& grid) {
    using Value = typename GridType::ValueType;
    openvdb::tools::Dense<Value, Layout> dense(denseBoxOf(grid, sizeof(Value)));
    openvdb::tools::copyToDense(grid, dense);
    requireFinite(grid, dense);
    return dense;
}

/// Returns the affine matrix of a grid's transform; row vectors, as OpenVDB has them. Throws ValueError if the
/// transform is not linear.
inline openvdb::Mat4d linearMapOf(const openvdb::GridBase& grid) {
    if (!grid.transform().isLinear())
        throw ValueError(
            fmt::format("{} has a transform that is not linear (a frustum); resample it first", titleOf(grid)));
    return grid.transform().baseMap()->getAffineMap()->getMat4();
}

/// Returns whether the voxels of a grid are cubes. GridBase::hasUniformVoxels() has absolute tolerances: it takes many
/// rotated cubes for other voxels, and all that are smaller than about 0.002.
inline bool hasCubicVoxels(const openvdb::GridBase& grid) {
    constexpr double kTolerance = 1e-6;
    if (!grid.transform().isLinear()) return false;
    const openvdb::Mat4d toWorld = linearMapOf(grid);
    const auto edge = [&](int i) { return openvdb::Vec3d(toWorld(i, 0), toWorld(i, 1), toWorld(i, 2)); };
    const double square = edge(0).lengthSqr();
    bool cubes = square > 0 && std::isfinite(square);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j <= i; ++j)
            cubes = cubes && std::abs(edge(i).dot(edge(j)) - (i == j ? square : 0)) <= kTolerance * square;
    return cubes;
}

} // namespace curlew
