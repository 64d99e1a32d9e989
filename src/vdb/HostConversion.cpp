// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/HostConversion.h"

#include "DenseBox.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/ScalarGrids.h"

#include <openvdb/tools/Prune.h>
#include <openvdb/tools/ValueTransformer.h>
#include <openvdb/tree/LeafManager.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace curlew {

namespace {

using openvdb::FloatGrid;
using openvdb::GridBase;
using openvdb::Vec3SGrid;

/// The same for any host: from the scene to metres with Y up, right-handed.
AxisMap toYUp(UpAxis up) { return up == UpAxis::z ? AxisMap{.from = {0, 2, 1}, .sign = {1, 1, -1}} : AxisMap{}; }

AxisMap fromYUp(HostAxes axes) {
    switch (axes) {
        case HostAxes::zUp:
            return {.from = {0, 2, 1}, .sign = {1, -1, 1}};
        case HostAxes::zUpLeftHanded:
            return {.from = {0, 2, 1}};
        case HostAxes::yUpLeftHanded:
            return {.sign = {-1, 1, 1}};
        case HostAxes::yUp:
            break;
    }
    return {};
}

AxisMap axesOf(const HostOptions& options) { return options.host ? axesFor(*options.host, options.up) : AxisMap{}; }

/// Maps three arrays as one array of vectors.
template <class T>
void mapArrays(std::vector<T>& x, std::vector<T>& y, std::vector<T>& z, const AxisMap& axes) {
    if (axes.identity()) return;
    for (size_t n = 0; n < x.size(); ++n) {
        const std::array<T, 3> mapped = [&] {
            const std::array<T, 3> v{x[n], y[n], z[n]};
            std::array<T, 3> result{};
            for (size_t k = 0; k < 3; ++k)
                result[k] = static_cast<T>(axes.sign[k] * axes.scale *
                                           static_cast<double>(v[static_cast<size_t>(axes.from[k])]));
            return result;
        }();
        x[n] = mapped[0], y[n] = mapped[1], z[n] = mapped[2];
    }
}

template <class PointsOrCurves>
void mapMotion(PointsOrCurves& p, const HostOptions& options) {
    AxisMap axes = axesOf(options);
    mapArrays(p.x, p.y, p.z, axes);
    axes.scale *= options.velocityScale;
    mapArrays(p.vx, p.vy, p.vz, axes);
}

/// Returns the grid with its transform followed by the map of axes. Shares the tree.
GridBase::ConstPtr withAxes(const GridBase::ConstPtr& grid, const AxisMap& axes) {
    if (axes.identity()) return grid;
    openvdb::Mat4d map = openvdb::Mat4d::zero();
    for (int k = 0; k < 3; ++k) {
        const auto at = static_cast<size_t>(k);
        map(axes.from[at], k) = axes.sign[at] * axes.scale; // for row vectors
    }
    map(3, 3) = 1;
    const auto transform = openvdb::math::Transform::createLinearTransform(linearMapOf(*grid) * map);
    return grid->copyGridReplacingTransform(transform);
}

template <class GridType, class Map>
typename GridType::Ptr withValues(const GridType& grid, const Map& map) {
    requireMemory(static_cast<double>(grid.memUsage()), "a copy of " + titleOf(grid), "free some memory");
    auto copy = grid.deepCopy();
    copy->tree().root().setBackground(map(grid.background()), /*updateChildNodes=*/false);
    openvdb::tools::foreach (copy->beginValueAll(), [&](const auto& value) { value.setValue(map(value.getValue())); });
    return copy;
}

/// Returns the grid with its values in the host's world. Shares the tree if they do not change.
GridBase::ConstPtr withHostValues(const GridBase::ConstPtr& grid, AxisMap axes, double velocityScale) {
    if (const auto vectors = GridBase::grid<Vec3SGrid>(grid)) {
        if (isVelocity(*grid)) axes.scale *= velocityScale;
        if (!axes.identity() && followsSpace(*grid))
            return withValues(*vectors, [&](const openvdb::Vec3s& v) { return axes(v); });
    }
    if (grid->getGridClass() != openvdb::GRID_LEVEL_SET || axes.scale == 1) return grid;
    if (const auto distances = GridBase::grid<FloatGrid>(grid))
        return withValues(*distances, [scale = static_cast<float>(axes.scale)](float d) { return scale * d; });
    if (const auto distances = GridBase::grid<openvdb::DoubleGrid>(grid))
        return withValues(*distances, [scale = axes.scale](double d) { return scale * d; });
    return grid;
}

/// Returns vectors of doubles as floats if the options change them. Hosts take velocities as floats.
GridBase::ConstPtr asFloats(const GridBase::ConstPtr& grid, const HostOptions& options) {
    const bool turned = !axesOf(options).identity() && followsSpace(*grid);
    const bool changed = turned || options.velocityScale != 1 || options.split;
    if (!changed || !grid->isType<openvdb::Vec3DGrid>()) return grid;
    requireMemory(0.5 * static_cast<double>(grid->memUsage()), "a copy of " + titleOf(*grid), "free some memory");
    return vectorsOf(grid);
}

std::vector<GridBase::ConstPtr> splitGrid(const Vec3SGrid& grid, std::string_view suffix) {
    std::vector<GridBase::ConstPtr> grids;
    grids.reserve(3);
    for (int k = 0; k < 3; ++k)
        grids.push_back(componentOf(grid, k, fmt::format("{}{}{}", grid.getName(), suffix, "xyz"[k])));
    return grids;
}

void requireComponents(const HostOptions& options) {
    if (!options.host || !options.host->componentSuffix.empty()) return;
    std::string able;
    for (const HostProfile& host : kHostProfiles)
        if (!host.componentSuffix.empty()) able += fmt::format("{}{}", able.empty() ? "" : ", ", host.name);
    throw ValueError(
        fmt::format("{} takes velocities as one vector grid, not as components; leave out split=1 (it is for "
                    "{})",
                    options.host->name, able));
}

} // namespace

AxisMap axesFor(const HostProfile& host, UpAxis up) {
    const AxisMap first = toYUp(up), second = fromYUp(host.axes);
    AxisMap both{.scale = host.unitsPerMetre};
    for (size_t k = 0; k < 3; ++k) {
        const auto middle = static_cast<size_t>(second.from[k]);
        both.from[k] = first.from[middle];
        both.sign[k] = second.sign[k] * first.sign[middle];
    }
    return both;
}

Mesh forHost(Mesh mesh, const HostOptions& options) {
    const AxisMap axes = axesOf(options);
    AxisMap directions = axes;
    directions.scale = 1;
    for (auto& point : mesh.points) point = axes(point);
    for (auto& normal : mesh.normals) normal = directions(normal);
    if (!axes.mirrors()) return mesh;
    for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
    for (auto& q : mesh.quads) std::swap(q[1], q[3]);
    return mesh;
}

Points forHost(Points points, const HostOptions& options) {
    mapMotion(points, options);
    return points;
}

Curves forHost(Curves curves, const HostOptions& options) {
    mapMotion(curves, options);
    const double scale = axesOf(options).scale;
    if (curves.by == StepBy::length)
        for (double& along : curves.along) along *= scale;
    for (double& length : curves.length) length *= scale;
    for (double& gap : curves.gap) gap *= scale;
    return curves;
}

bool isVelocity(const GridBase& grid) {
    if (!grid.isType<Vec3SGrid>()) return false;
    const std::string& name = grid.getName();
    return name == "vel" || name == "v" ||
           std::any_of(kHostProfiles.begin(), kHostProfiles.end(),
                       [&](const HostProfile& host) { return name == host.gridVelocity; });
}

bool followsSpace(const GridBase& grid) {
    if (isVelocity(grid) || grid.getGridClass() == openvdb::GRID_STAGGERED) return true;
    const auto type = grid.getMetadata<openvdb::StringMetadata>(GridBase::META_VECTOR_TYPE);
    return !type || type->value() != GridBase::vecTypeToString(openvdb::VEC_INVARIANT);
}

std::vector<GridBase::ConstPtr> forHost(const GridBase::ConstPtr& given, const HostOptions& options) {
    const GridBase::ConstPtr grid = asFloats(given, options);
    const AxisMap axes = axesOf(options);
    const auto vectors = GridBase::grid<Vec3SGrid>(grid);
    if (vectors && options.split) requireComponents(options);

    GridBase::ConstPtr made = grid;
    const bool centred = (options.host && !options.host->staggered) || axes.turns() || options.split;
    if (vectors && grid->getGridClass() == openvdb::GRID_STAGGERED && centred) made = collocated(*vectors);
    made = withAxes(withHostValues(made, axes, options.velocityScale), axes);

    openvdb::MetaMap metadata(static_cast<const openvdb::MetaMap&>(*made));
    const bool renamed = options.host && isVelocity(*grid) && grid->getName() != options.host->gridVelocity;
    const bool reclassed = vectors && options.host && options.host->fogVectors;
    if (renamed)
        metadata.insertMeta(GridBase::META_GRID_NAME, openvdb::StringMetadata(std::string(options.host->gridVelocity)));
    if (reclassed)
        metadata.insertMeta(GridBase::META_GRID_CLASS,
                            openvdb::StringMetadata(GridBase::gridClassToString(openvdb::GRID_FOG_VOLUME)));
    if (renamed || reclassed) made = made->copyGridReplacingMetadata(metadata);
    if (!vectors || !options.split) return {made};
    return splitGrid(*GridBase::grid<Vec3SGrid>(made), options.host ? options.host->componentSuffix : ".");
}

Vec3SGrid::Ptr collocated(const Vec3SGrid& staggered) {
    const auto inTiles = static_cast<double>(staggered.activeVoxelCount() - staggered.tree().activeLeafVoxelCount());
    requireMemory(2 * (static_cast<double>(staggered.memUsage()) + inTiles * sizeof(openvdb::Vec3s)),
                  "a copy of " + titleOf(staggered) + " at voxel centres", "make the velocities without staggered=1");
    if (inTiles > 0) { // the voxels at the sides of a tile have faces of its neighbours
        const auto voxels = staggered.deepCopy();
        voxels->tree().voxelizeActiveTiles();
        auto centred = collocated(*voxels);
        openvdb::tools::prune(centred->tree());
        return centred;
    }
    auto centred = staggered.deepCopy();
    centred->setGridClass(openvdb::GRID_UNKNOWN);
    // A voxel has its lower faces. If it lacks upper ones, it is either at a wall, where they rest, or in the last
    // layer at a side of the grid, where they are taken to move as the lower ones do.
    constexpr float kClosed = 1e-3f; // of the flow through all faces
    openvdb::tree::LeafManager<openvdb::Vec3STree> leaves(centred->tree());
    leaves.foreach ([&](auto& leaf, size_t) {
        const openvdb::tree::ValueAccessor<const openvdb::Vec3STree> faces(staggered.tree());
        for (auto value = leaf.beginValueOn(); value; ++value) {
            const openvdb::Vec3s lower = *value;
            openvdb::Vec3s upper, continued;
            float sum = 0, size = 0;
            for (int axis = 0; axis < 3; ++axis) {
                openvdb::Coord above = value.getCoord();
                ++above[axis];
                upper[axis] = faces.getValue(above)[axis];
                continued[axis] = faces.isValueOn(above) ? upper[axis] : lower[axis];
                sum += upper[axis] - lower[axis];
                size += std::abs(upper[axis]) + std::abs(lower[axis]);
            }
            value.setValue(0.5f * (lower + (std::abs(sum) <= kClosed * size ? upper : continued)));
        }
    });
    return centred;
}

} // namespace curlew
