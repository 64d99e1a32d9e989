// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/VectorFieldFile.h"

#include "ChunkedWriter.h"
#include "DenseBox.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/HostConversion.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/compile.h>
#include <openvdb/tools/Interpolation.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <utility>

namespace curlew {

namespace {

namespace fs = std::filesystem;
using openvdb::Coord;
using openvdb::GridBase;
using openvdb::Vec3SGrid;

/// For each axis of the world, the axis of the grid that is parallel to it and the world units per voxel; negative if
/// they point in opposite directions.
struct Alignment {
    std::array<int, 3> axis{};
    openvdb::Vec3d step;
};

/// Returns nullopt if the axes of the grid are not those of the world, or not straight.
std::optional<Alignment> alignmentOf(const GridBase& grid) {
    constexpr double kOblique = 1e-6; // relative to the voxel size; rounding of rotations by 90 degrees is far below
    if (!grid.transform().isLinear()) return std::nullopt;
    const openvdb::Mat4d map = linearMapOf(grid);
    Alignment found;
    for (int world = 0; world < 3; ++world) {
        int parallel = 0;
        for (int axis = 1; axis < 3; ++axis)
            if (std::abs(map(axis, world)) > std::abs(map(parallel, world))) parallel = axis;
        found.axis[static_cast<size_t>(world)] = parallel;
        found.step[world] = map(parallel, world);
        for (int axis = 0; axis < 3; ++axis)
            if (axis != parallel && std::abs(map(axis, world)) > kOblique * std::abs(map(parallel, world)))
                return std::nullopt;
    }
    return found;
}

/// A dense copy of a grid that is visited in the order of the world's axes.
template <class GridType>
class WorldBox {
  public:
    using Dense = openvdb::tools::Dense<typename GridType::ValueType, openvdb::tools::LayoutXYZ>;

    WorldBox(const GridType& grid, const Alignment& alignment)
        : mAlignment(alignment), mDense(denseCopy<openvdb::tools::LayoutXYZ>(grid)) {
        const openvdb::CoordBBox& box = mDense.bbox();
        for (int world = 0; world < 3; ++world) {
            const int axis = mAlignment.axis[static_cast<size_t>(world)];
            const double step = mAlignment.step[world];
            mFirst[axis] = step > 0 ? box.min()[axis] : box.max()[axis];
            mBox.size[world] = box.dim()[axis];
        }
        mBox.lower = grid.indexToWorld(mFirst);
        for (int world = 0; world < 3; ++world) {
            const double voxel = std::abs(mAlignment.step[world]);
            mBox.lower[world] -= 0.5 * voxel;
            mBox.upper[world] = mBox.lower[world] + voxel * mBox.size[world];
        }
    }

    /// `values`: those of the box, whose axes are those of the world.
    WorldBox(const FieldBox& box, Dense values)
        : mAlignment{{0, 1, 2}, openvdb::Vec3d(1)}, mDense(std::move(values)), mFirst(0, 0, 0), mBox(box) {}

    const FieldBox& box() const { return mBox; }
    size_t count() const { return mDense.valueCount(); }

    /// Returns value n, x fastest.
    const typename GridType::ValueType& at(size_t n) const {
        Coord ijk = mFirst;
        for (int world = 0; world < 3; ++world) {
            const auto size = static_cast<size_t>(mBox.size[world]);
            const int axis = mAlignment.axis[static_cast<size_t>(world)];
            ijk[axis] += (mAlignment.step[world] > 0 ? 1 : -1) * static_cast<int>(n % size);
            n /= size;
        }
        return mDense.getValue(ijk);
    }

  private:
    Alignment mAlignment;
    Dense mDense;
    Coord mFirst;
    FieldBox mBox;
};

/// Returns a box along the world's axes around the active voxels of a grid. Its voxels are cubes as large as the grid's
/// smallest edge, or larger if more than `maxSize` would be needed along an axis.
FieldBox boxAround(const GridBase& grid, int maxSize) {
    const openvdb::CoordBBox active = grid.evalActiveVoxelBoundingBox();
    if (active.empty())
        throw ValueError(fmt::format("{} has no active voxels, so there is nothing to write", titleOf(grid)));
    openvdb::BBoxd world; // a linear transform and a frustum both keep edges straight
    for (int corner = 0; corner < 8; ++corner) {
        openvdb::Vec3d ijk;
        for (int axis = 0; axis < 3; ++axis)
            ijk[axis] = (corner >> axis & 1) != 0 ? active.max()[axis] + 0.5 : active.min()[axis] - 0.5;
        world.expand(grid.indexToWorld(ijk));
    }
    const openvdb::Vec3d edges = grid.voxelSize(), extents = world.extents();
    const double smallest = std::min({edges[0], edges[1], edges[2]});
    const double voxel = std::max(smallest, std::max({extents[0], extents[1], extents[2]}) / maxSize);
    FieldBox box;
    box.resampled = true;
    for (int axis = 0; axis < 3; ++axis) {
        constexpr double kRounding = 1e-9; // a box of whole voxels gets no further voxel
        box.size[axis] = std::clamp(static_cast<int>(std::ceil(extents[axis] / voxel - kRounding)), 1, maxSize);
        box.lower[axis] = world.getCenter()[axis] - 0.5 * voxel * box.size[axis];
        box.upper[axis] = box.lower[axis] + voxel * box.size[axis];
    }
    return box;
}

double wide(float value) { return static_cast<double>(value); }
openvdb::Vec3d wide(const openvdb::Vec3s& value) { return openvdb::Vec3d(value); }

/// Samples a grid at the voxels of boxAround(). Larger voxels than the grid's get the mean of several trilinear
/// samples, one for each voxel of the grid in them (up to 16 along an edge), so that no detail is skipped.
template <class GridType>
WorldBox<GridType> resampled(const GridType& grid, int maxSize, const Monitor& monitor) {
    using Value = typename GridType::ValueType;
    const FieldBox box = boxAround(grid, maxSize);
    const auto count = [&](int axis) { return static_cast<size_t>(box.size[axis]); };
    requireMemory(static_cast<double>(count(0) * count(1) * count(2) * sizeof(Value)),
                  fmt::format("{} as a dense box of {} x {} x {} voxels", titleOf(grid), count(0), count(1), count(2)),
                  "use larger voxels or a smaller box");
    const double voxel = (box.upper[0] - box.lower[0]) / box.size[0];
    const openvdb::Vec3d edges = grid.voxelSize();
    constexpr double kMostParts = 16; // along an edge
    const double exact = std::ceil(voxel / std::min({edges[0], edges[1], edges[2]}) - 1e-6);
    const int parts = static_cast<int>(std::min(exact, kMostParts));
    const double part = voxel / std::max(parts, 1);
    typename WorldBox<GridType>::Dense dense(openvdb::CoordBBox(Coord(0), box.size - Coord(1)));
    const auto meanAt = [&](const auto& sampler, const Coord& ijk) {
        decltype(wide(Value())) sum(0);
        const openvdb::Vec3d first =
            box.lower + openvdb::Vec3d(voxel * ijk[0], voxel * ijk[1], voxel * ijk[2]) + openvdb::Vec3d(0.5 * part);
        const int64_t n = std::max(parts, 1);
        for (int64_t k = 0; k < n * n * n; ++k) {
            const Coord at(static_cast<int>(k % n), static_cast<int>(k / n % n), static_cast<int>(k / n / n));
            sum += wide(sampler.wsSample(first + part * at.asVec3d()));
        }
        return Value(sum / static_cast<double>(n * n * n));
    };
    parallelFor(
        count(1) * count(2), 16,
        [&](size_t begin, size_t end) {
            const auto values = grid.getConstAccessor();
            const openvdb::tools::GridSampler<typename GridType::ConstAccessor, openvdb::tools::BoxSampler> sampler(
                values, grid.transform());
            for (size_t row = begin; row < end; ++row)
                for (Coord ijk(0, static_cast<int>(row % count(1)), static_cast<int>(row / count(1)));
                     ijk[0] < box.size[0]; ++ijk[0])
                    dense.setValue(ijk, meanAt(sampler, ijk));
        },
        monitor);
    requireFinite(grid, dense);
    return {box, std::move(dense)};
}

/// Returns the voxels of a grid in the order of the world's axes, resampled if its axes are others or if it has more
/// than `maxSize` voxels along one.
template <class GridType>
WorldBox<GridType> worldBoxOf(const GridType& grid, int maxSize, const Monitor& monitor) {
    const std::optional<Alignment> alignment = alignmentOf(grid);
    const Coord size = grid.evalActiveVoxelDim();
    if (alignment && std::max({size[0], size[1], size[2]}) <= maxSize) return {grid, *alignment};
    return resampled(grid, maxSize, monitor);
}

Vec3SGrid::ConstPtr centred(const Vec3SGrid& grid) {
    return grid.getGridClass() == openvdb::GRID_STAGGERED ? Vec3SGrid::ConstPtr(collocated(grid))
                                                          : Vec3SGrid::ConstPtr(&grid, [](const Vec3SGrid*) {});
}

void requireHalves(const GridBase& grid, const WorldBox<Vec3SGrid>& box) {
    for (size_t n = 0; n < box.count(); ++n)
        for (int k = 0; k < 3; ++k)
            if (const float value = box.at(n)[k]; std::abs(value) > kMaxFgaValue)
                throw ValueError(
                    fmt::format("{} has a component of {:g}, above {:.0f}, the largest value that the 16-bit floats of "
                                "a vector field can hold; lower the speed or the unit",
                                titleOf(grid), value, kMaxFgaValue));
}

template <class GridType, class Append>
FieldBox writeVfGrid(const fs::path& path, const GridType& grid, std::string_view magic, const Monitor& monitor,
                     const Append& append) {
    const auto box = worldBoxOf(grid, std::numeric_limits<uint16_t>::max(), monitor);
    writeAtomically(
        path,
        [&](std::ostream& out) {
            std::string header(magic);
            for (int k = 0; k < 3; ++k) appendBytes(header, static_cast<uint16_t>(box.box().size[k]));
            out << header;
            writeChunks(out, box.count(), [&](size_t begin, size_t end, std::string& bytes) {
                for (size_t n = begin; n < end; ++n) append(bytes, box.at(n));
            });
        },
        monitor.cancelled);
    return box.box();
}

} // namespace

FieldBox writeFga(const fs::path& path, const Vec3SGrid& grid, const Monitor& monitor) {
    const auto vectors = centred(grid);
    const auto box = worldBoxOf(*vectors, kMaxFgaSize, monitor);
    requireHalves(grid, box);
    const FieldBox& b = box.box();
    writeAtomically(
        path,
        [&](std::ostream& out) {
            out << fmt::format("{},{},{},\n{},{},{},\n{},{},{}", b.size[0], b.size[1], b.size[2], b.lower[0],
                               b.lower[1], b.lower[2], b.upper[0], b.upper[1], b.upper[2]);
            writeChunks(out, box.count(), [&](size_t begin, size_t end, std::string& text) {
                for (size_t n = begin; n < end; ++n) {
                    const openvdb::Vec3s& v = box.at(n);
                    fmt::format_to(std::back_inserter(text), FMT_COMPILE(",\n{},{},{}"), v[0], v[1], v[2]);
                }
            });
            out << '\n';
        },
        monitor.cancelled);
    return b;
}

FieldBox writeVf(const fs::path& path, const GridBase& grid, const Monitor& monitor) {
    if (grid.isType<Vec3SGrid>())
        return writeVfGrid(path, *centred(static_cast<const Vec3SGrid&>(grid)), "VF_V", monitor,
                           [](std::string& bytes, const openvdb::Vec3s& v) {
                               for (int k = 0; k < 3; ++k) appendBytes(bytes, v[k]);
                           });
    if (grid.isType<openvdb::FloatGrid>())
        return writeVfGrid(path, static_cast<const openvdb::FloatGrid&>(grid), "VF_F", monitor,
                           [](std::string& bytes, float value) { appendBytes(bytes, value); });
    throw ValueError(fmt::format("{} is of type {}; a .vf holds float or vec3s", titleOf(grid), grid.valueType()));
}

} // namespace curlew
