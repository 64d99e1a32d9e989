// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/LevelSetBoolean.h"

#include "BandSize.h"
#include "Enclosed.h"
#include "SolidChecks.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/HostConversion.h"
#include "curlew/vdb/Interrupter.h"
#include "curlew/vdb/MeshSolid.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/format.h>
#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/Composite.h>
#include <openvdb/tools/FastSweeping.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/LevelSetRebuild.h>
#include <openvdb/tools/LevelSetUtil.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>
#include <cmath>

namespace curlew {

namespace {

using openvdb::Coord;
using openvdb::FloatGrid;

/// Returns whether the grid has the transform that solidOf() uses for its voxel size, so that it can be made again.
bool onOrigin(const FloatGrid& grid) {
    const auto plain = openvdb::math::Transform::createLinearTransform(grid.voxelSize()[0]);
    return grid.transform() == *plain;
}

Mesh joined(const Mesh& a, const Mesh& b) {
    Mesh mesh = a;
    const auto first = static_cast<openvdb::Index32>(a.points.size());
    mesh.points.insert(mesh.points.end(), b.points.begin(), b.points.end());
    for (const auto& t : b.triangles) mesh.triangles.push_back(t + openvdb::Vec3I(first));
    for (const auto& q : b.quads) mesh.quads.push_back(q + openvdb::Vec4I(first));
    return mesh;
}

/// Resamples a level set onto the grid of another.
LevelSet onGridOf(const LevelSet& like, const LevelSet& levelSet, const Monitor& monitor) {
    if (levelSet.grid->transform() == like.grid->transform()) return levelSet;
    if (levelSet.mesh && onOrigin(*like.grid))
        return solidOf(levelSet.mesh,
                       {.voxel = like.voxelSize(),
                        .halfWidth = like.halfWidth(),
                        .thickness = thicknessOf(*levelSet.grid),
                        .measureParts = false},
                       monitor)
            .levelSet;
    // Uses polygons of its surface: resampling (tools/GridTransformer.h) does not compile as C++20 with TBB.
    Interrupter interrupter(monitor);
    const auto width = static_cast<float>(like.halfWidth());
    const auto grid = openvdb::tools::levelSetRebuild(*levelSet.grid, 0, width, width, &like.grid->transform(),
                                                      &interrupter.interrupter());
    monitor.check();
    return {grid, nullptr};
}

FloatGrid::Ptr composite(const FloatGrid& a, const FloatGrid& b, Boolean operation) {
    switch (operation) {
        case Boolean::unite:
            return openvdb::tools::csgUnionCopy(a, b);
        case Boolean::intersect:
            return openvdb::tools::csgIntersectionCopy(a, b);
        default:
            return openvdb::tools::csgDifferenceCopy(a, b);
    }
}

/// Returns whether the surface passes between a voxel and one of its neighbours.
template <class Access>
bool atSurface(const Access& tree, const Coord& voxel, float value) {
    for (int axis = 0; axis < 3; ++axis)
        for (const int by : {-1, 1}) {
            Coord next = voxel;
            next[axis] += by;
            if ((tree.getValue(next) < 0) != (value < 0)) return true;
        }
    return false;
}

/// Replaces values that are not distances because the closest point has been cut away.
void repairDistances(FloatGrid& grid, const Monitor& monitor) {
    const auto swept = openvdb::tools::sdfToSdf(grid);
    monitor.check();
    const double h = grid.voxelSize()[0];
    const openvdb::FloatTree before(grid.tree());
    std::vector<openvdb::FloatTree::LeafNodeType*> leaves;
    grid.tree().getNodes(leaves);
    parallelFor(
        leaves.size(), 16,
        [&](size_t begin, size_t end) {
            const openvdb::tree::ValueAccessor<const openvdb::FloatTree> old(before), sweep(swept->tree());
            for (size_t n = begin; n < end; ++n)
                for (auto value = leaves[n]->beginValueOn(); value; ++value) {
                    const Coord voxel = value.getCoord();
                    const double d = static_cast<double>(*value) / h;
                    if (atSurface(old, voxel, *value)) continue;
                    openvdb::Vec3d gradient;
                    for (int axis = 0; axis < 3; ++axis) {
                        Coord up = voxel, down = voxel;
                        ++up[axis], --down[axis];
                        // One-sided towards known values at the edge of the band.
                        const double forward = static_cast<double>(old.getValue(up)) / h - d,
                                     backward = d - static_cast<double>(old.getValue(down)) / h;
                        gradient[axis] = !old.isValueOn(up)     ? backward
                                         : !old.isValueOn(down) ? forward
                                                                : 0.5 * (forward + backward);
                    }
                    const openvdb::Vec3d closest = voxel.asVec3d() - gradient * d;
                    const double off = static_cast<double>(openvdb::tools::BoxSampler::sample(old, closest)) / h;
                    float fresh = 0;
                    if (!(std::abs(off) < 0.15) && sweep.probeValue(voxel, fresh) && (fresh < 0) == (*value < 0))
                        value.setValue(fresh);
                }
        },
        monitor);
}

openvdb::Mat4d matrixOf(const Placement& placement) {
    openvdb::Mat4d m = openvdb::Mat4d::identity();
    m.postScale(openvdb::Vec3d(placement.scale[0], placement.scale[1], placement.scale[2]));
    constexpr double kDegree = 0.017453292519943295;
    m.postRotate(openvdb::math::X_AXIS, placement.rotate[0] * kDegree);
    m.postRotate(openvdb::math::Y_AXIS, placement.rotate[1] * kDegree);
    m.postRotate(openvdb::math::Z_AXIS, placement.rotate[2] * kDegree);
    m.postTranslate(openvdb::Vec3d(placement.offset[0], placement.offset[1], placement.offset[2]));
    return m;
}

void requireSimilar(const Placement& placement) {
    const Vec3d& s = placement.scale;
    if (!(s[0] > 0 && s[0] == s[1] && s[1] == s[2] && std::isfinite(s[0])))
        throw ValueError(fmt::format("scale {}, {}, {} must be positive and equal along all axes", s[0], s[1], s[2]));
}

} // namespace

LevelSet combined(const LevelSet& first, const LevelSet& second, Boolean operation, const Monitor& monitor) {
    if (operation == Boolean::unite && first.mesh && second.mesh && onOrigin(*first.grid) &&
        thicknessOf(*first.grid) == 0 && thicknessOf(*second.grid) == 0)
        return meshToLevelSet(
            std::make_shared<Mesh>(joined(*first.mesh, *second.mesh)),
            {.voxel = first.voxelSize(), .halfWidth = std::max(first.halfWidth(), second.halfWidth())}, monitor);
    const double width = std::max(first.halfWidth(), second.halfWidth());
    const LevelSet a = widened(first, width, monitor), b = widened(onGridOf(a, second, monitor), width, monitor);
    const auto grid = composite(*a.grid, *b.grid, operation);
    monitor.check();
    if (!enclosesSomething(*grid))
        throw ValueError(operation == Boolean::intersect ? "the two do not overlap: the intersection is empty"
                                                         : "nothing is left: the difference is empty");
    repairDistances(*grid, monitor);
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    grid->removeMeta(kThickness);
    grid->setName("surface");
    return {grid, nullptr};
}

LevelSet sampledShape(const Sdf& shape, const LevelSet& like, const Monitor& monitor) {
    const auto grid = FloatGrid::create(like.grid->background());
    grid->setTransform(like.grid->transform().copy());
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    const double h = like.voxelSize(), width = static_cast<double>(like.grid->background());
    // The box of the leaves that may hold a part of the band.
    openvdb::CoordBBox box = like.grid->evalActiveVoxelBoundingBox();
    if (shape.bounds.finite()) {
        openvdb::CoordBBox own;
        for (int corner = 0; corner < 8; ++corner) {
            openvdb::Vec3d p;
            for (int axis = 0; axis < 3; ++axis)
                p[axis] = (corner >> axis & 1) ? shape.bounds.upper[axis] + width : shape.bounds.lower[axis] - width;
            own.expand(Coord::floor(grid->worldToIndex(p)));
            own.expand(Coord::ceil(grid->worldToIndex(p)));
        }
        box = own;
    }
    using Leaf = openvdb::FloatTree::LeafNodeType;
    std::vector<Coord> origins;
    const double radius = 0.5 * std::sqrt(3.0) * static_cast<double>(Leaf::DIM) * h + width;
    const auto distance = [&](const openvdb::Vec3d& ijk) {
        const openvdb::Vec3d p = grid->indexToWorld(ijk);
        return shape.distance.at<0>({{p[0], p[1], p[2]}}).value;
    };
    constexpr int kDim = Leaf::DIM;
    const Coord low = box.min() & ~(kDim - 1);
    for (int x = low.x(); x <= box.max().x(); x += kDim)
        for (int y = low.y(); y <= box.max().y(); y += kDim)
            for (int z = low.z(); z <= box.max().z(); z += kDim)
                if (std::abs(distance(openvdb::Vec3d(x, y, z) + openvdb::Vec3d(0.5 * (kDim - 1)))) < radius)
                    origins.emplace_back(x, y, z);
    std::vector<std::unique_ptr<Leaf>> leaves(origins.size());
    parallelFor(
        origins.size(), 8,
        [&](size_t begin, size_t end) {
            for (size_t n = begin; n < end; ++n) {
                leaves[n] = std::make_unique<Leaf>(origins[n], grid->background());
                for (openvdb::Index k = 0; k < Leaf::SIZE; ++k) {
                    const auto d = static_cast<float>(distance(leaves[n]->offsetToGlobalCoord(k).asVec3d()));
                    const float bound = grid->background();
                    leaves[n]->setValueOnly(k, std::clamp(d, -bound, bound));
                    if (std::abs(d) < bound) leaves[n]->setValueOn(k);
                }
            }
        },
        monitor);
    for (auto& leaf : leaves)
        if (!leaf->isEmpty()) grid->tree().addLeaf(leaf.release());
    openvdb::tools::signedFloodFill(grid->tree());
    if (!enclosesSomething(*grid))
        throw ValueError("the shape contains no voxel centre of the level set's grid; use smaller voxels");
    grid->setName("surface");
    return {grid, nullptr};
}

Mesh placed(const Mesh& mesh, const Placement& placement) {
    requireSimilar(placement);
    const openvdb::Mat4d m = matrixOf(placement);
    Mesh result = mesh;
    for (auto& p : result.points) p = openvdb::Vec3s(m.transform(openvdb::Vec3d(p)));
    return result;
}

openvdb::GridBase::Ptr placed(const openvdb::GridBase& grid, const Placement& placement) {
    requireSimilar(placement);
    const bool turned = !(placement.rotate == Vec3d{});
    if (turned && grid.getGridClass() == openvdb::GRID_STAGGERED)
        throw ValueError(
            fmt::format("grid '{}' is staggered: its components follow its own axes; rotate a collocated grid instead",
                        grid.getName()));
    auto result = grid.deepCopyGrid();
    const openvdb::Mat4d m = matrixOf(placement);
    result->transform().postMult(m);
    const openvdb::Mat4d rotation = matrixOf({.rotate = placement.rotate});
    const auto turn = [&](const auto& vectors) {
        if (!vectors || !turned || !followsSpace(grid)) return;
        for (auto value = vectors->beginValueAll(); value; ++value) {
            using Value = std::remove_cvref_t<decltype(*value)>;
            value.setValue(Value(rotation.transform(openvdb::Vec3d(*value))));
        }
    };
    turn(openvdb::GridBase::grid<openvdb::Vec3SGrid>(result));
    turn(openvdb::GridBase::grid<openvdb::Vec3DGrid>(result));
    if (const auto distances = openvdb::GridBase::grid<openvdb::DoubleGrid>(result);
        distances && grid.getGridClass() == openvdb::GRID_LEVEL_SET) {
        const double scale = placement.scale[0];
        for (auto value = distances->beginValueAll(); value; ++value) value.setValue(*value * scale);
        distances->tree().root().setBackground(distances->background() * scale, /*updateChildNodes=*/false);
    }
    return result;
}

LevelSet placed(const LevelSet& levelSet, const Placement& placement) {
    auto grid =
        openvdb::GridBase::grid<FloatGrid>(placed(static_cast<const openvdb::GridBase&>(*levelSet.grid), placement));
    const auto scale = static_cast<float>(placement.scale[0]);
    const float background = grid->background() * scale;
    for (auto value = grid->beginValueAll(); value; ++value) value.setValue(*value * scale);
    openvdb::tools::changeBackground(grid->tree(), background);
    LevelSet result{grid, nullptr};
    if (levelSet.mesh) {
        auto mesh = std::make_shared<Mesh>(placed(*levelSet.mesh, placement));
        // Far from the origin the grid stays exact, since its transform is double, but the mesh does not.
        if (spacingOf(*mesh) <= kMaxSpacing * result.voxelSize()) result.mesh = std::move(mesh);
    }
    if (const double thickness = thicknessOf(*levelSet.grid); thickness > 0) {
        grid->removeMeta(kThickness);
        grid->insertMeta(kThickness, openvdb::DoubleMetadata(thickness * placement.scale[0]));
    }
    return result;
}

} // namespace curlew
