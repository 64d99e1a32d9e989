// SPDX-License-Identifier: Apache-2.0
#include "VelocityLattice.h"

#include "DenseBox.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/ScalarGrids.h"

#include <cmath>

namespace curlew {

namespace {

using openvdb::FloatGrid;
using openvdb::GridBase;

FloatGrid::ConstPtr floatsOf(const GridBase::ConstPtr& grid) {
    if (auto floats = GridBase::grid<FloatGrid>(grid)) return floats;
    if (const auto doubles = GridBase::grid<openvdb::DoubleGrid>(grid)) return std::make_shared<FloatGrid>(*doubles);
    return nullptr;
}

std::array<FloatGrid::ConstPtr, 3> componentsOf(const VelocityGrids& grids) {
    if (grids.size() == 1)
        if (const auto vectors = vectorsOf(grids[0]))
            return {componentOf(*vectors, 0, "x"), componentOf(*vectors, 1, "y"), componentOf(*vectors, 2, "z")};
    if (grids.size() == 3) {
        std::array<FloatGrid::ConstPtr, 3> components;
        for (size_t k = 0; k < 3; ++k) components[k] = floatsOf(grids[k]);
        if (components[0] && components[1] && components[2]) return components;
    }
    throw ValueError("a velocity is one grid of vectors, or three scalar grids of its components");
}

void requireFinite(const FloatGrid& component, const std::string& title) {
    size_t bad = 0;
    for (auto value = component.cbeginValueOn(); value; ++value) bad += !std::isfinite(*value);
    if (bad > 0) throw ValueError(fmt::format("{} has {} values that are not finite (NaN or infinite)", title, bad));
}

/// Sets the frame of the lattice to that of a grid.
void setFrame(VelocityLattice& lattice, const GridBase& grid) {
    const openvdb::Mat4d toWorld = linearMapOf(grid);
    if (!hasCubicVoxels(grid))
        throw ValueError(fmt::format("the voxels of {} are not cubes; resample it first", titleOf(grid)));
    lattice.voxel = grid.voxelSize()[0];
    const openvdb::Mat4d toIndex = toWorld.inverse(); // row vectors: x_index = x_world M
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            lattice.toIndex[i][j] = toIndex(j, i);
            lattice.axes[i][j] = toWorld(i, j) / lattice.voxel;
        }
        lattice.shift[i] = toIndex(3, i);
    }
    lattice.mirrored = dot(cross(lattice.axes[0], lattice.axes[1]), lattice.axes[2]) < 0;
}

/// Compares the origins of the grids of three components: the same for a collocated grid, half a voxel lower along each
/// component's axis for a staggered one, whose frame this sets.
void matchOrigins(VelocityLattice& lattice, const VelocityGrids& grids) {
    constexpr double kTolerance = 1e-3; // voxels
    std::array<Vec3d, 3> origin;        // of each grid in index coordinates of the first
    for (size_t k = 0; k < 3; ++k) {
        const openvdb::Vec3d world = grids[k]->transform().indexToWorld(openvdb::Vec3d(0));
        origin[k] = lattice.toIndex * Vec3d{{world[0], world[1], world[2]}} + lattice.shift;
        VelocityLattice other;
        setFrame(other, *grids[k]);
        for (int i = 0; i < 3; ++i)
            if (length(other.toIndex[i] - lattice.toIndex[i]) * lattice.voxel > kTolerance)
                throw ValueError("the three grids of the velocity have voxels of different sizes or orientations");
    }
    const auto same = [&](const Vec3d& a, const Vec3d& b) { return length(a - b) <= kTolerance; };
    if (same(origin[1], origin[0]) && same(origin[2], origin[0])) return;
    if (!same(origin[1] - origin[0], {{0.5, -0.5, 0}}) || !same(origin[2] - origin[0], {{0.5, 0, -0.5}}))
        throw ValueError("the three grids of the velocity are neither at the same voxels nor at their faces");
    lattice.staggered = true;
    lattice.shift[0] -= 0.5; // the centres of the voxels are half a voxel above the faces of x
}

} // namespace

VelocityLattice latticeOf(const VelocityGrids& grids) {
    VelocityLattice lattice;
    lattice.components = componentsOf(grids);
    lattice.staggered = grids[0]->getGridClass() == openvdb::GRID_STAGGERED;
    setFrame(lattice, *grids[0]);
    if (grids.size() == 3) matchOrigins(lattice, grids);
    for (size_t k = 0; k < 3; ++k) {
        const FloatGrid& component = *lattice.components[k];
        requireFinite(component, titleOf(*grids[grids.size() == 3 ? k : 0]));
        lattice.active.expand(component.evalActiveVoxelBoundingBox());
    }
    if (lattice.active.empty())
        throw ValueError(fmt::format("{} has no active voxels, so it is no flow", titleOf(*grids[0])));
    return lattice;
}

bool isStaggered(const VelocityGrids& grids) { return latticeOf(grids).staggered; }

} // namespace curlew
