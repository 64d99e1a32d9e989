// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/VectorFieldFile.h"

#include "ChunkedWriter.h"
#include "DenseBox.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/vdb/HostConversion.h"

#include <fmt/compile.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>

namespace curlew {

namespace {

namespace fs = std::filesystem;
using openvdb::Coord;
using openvdb::GridBase;
using openvdb::Vec3d;
using openvdb::Vec3SGrid;

/// For each axis of the world, the axis of the grid that is parallel to it and the world units per voxel; negative if
/// they point in opposite directions.
struct Alignment {
    std::array<int, 3> axis{};
    Vec3d step;
};

Alignment alignmentOf(const GridBase& grid) {
    constexpr double kOblique = 1e-6; // relative to the voxel size; rounding of rotations by 90 degrees is far below
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
                throw ValueError(fmt::format(
                    "{} is not aligned with the axes, which a vector field has to be; make it with -velocity",
                    titleOf(grid)));
    }
    return found;
}

/// A dense copy of a grid that is visited in the order of the world's axes.
template <class GridType>
class WorldBox {
  public:
    explicit WorldBox(const GridType& grid)
        : mAlignment(alignmentOf(grid)), mDense(denseCopy<openvdb::tools::LayoutXYZ>(grid)) {
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
    openvdb::tools::Dense<typename GridType::ValueType, openvdb::tools::LayoutXYZ> mDense;
    Coord mFirst;
    FieldBox mBox;
};

/// Throws ValueError if the box has more voxels along an axis than the format allows. Call it before the box is copied.
void requireSize(const GridBase& grid, int most, const std::string& extension) {
    const Coord size = grid.evalActiveVoxelDim();
    const int longest = std::max({size[0], size[1], size[2]});
    if (longest > most)
        throw ValueError(
            fmt::format("{} has {} x {} x {} voxels, but {} holds at most {} along each axis; use -velocity "
                        "dim={} or larger voxels",
                        titleOf(grid), size[0], size[1], size[2], extension, most, most));
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
                                "a vector field can hold; "
                                "lower the speed or the unit",
                                titleOf(grid), value, kMaxFgaValue));
}

template <class GridType, class Append>
FieldBox writeVfGrid(const fs::path& path, const GridType& grid, std::string_view magic, const Monitor& monitor,
                     const Append& append) {
    requireSize(grid, std::numeric_limits<uint16_t>::max(), ".vf");
    const WorldBox<GridType> box(grid);
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
    requireSize(*vectors, kMaxFgaSize, ".fga");
    const WorldBox<Vec3SGrid> box(*vectors);
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
