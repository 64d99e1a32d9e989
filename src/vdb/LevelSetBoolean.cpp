// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/LevelSetBoolean.h"

#include "BandSize.h"
#include "Enclosed.h"
#include "SolidChecks.h"
#include "curlew/base/Memory.h"
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

// ---- Shapes

using ShapeLeaf = openvdb::FloatTree::LeafNodeType;

/// Returns the box of a bounded shape's band, in voxels of the grid of a level set.
openvdb::BBoxd bandBox(const Sdf& shape, const LevelSet& like) {
    const auto width = static_cast<double>(like.grid->background());
    openvdb::BBoxd box;
    for (int corner = 0; corner < 8; ++corner) {
        openvdb::Vec3d p;
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = (corner >> axis & 1) ? shape.bounds.upper[axis] + width : shape.bounds.lower[axis] - width;
        box.expand(like.grid->worldToIndex(p));
    }
    return box;
}

/// The values of a sampled shape where it has no leaves.
enum class Tiles {
    background, ///< Outside everywhere, for a flood fill.
    signs       ///< Inside or outside, in the box.
};

/// Origins of the leaves of a shape.
struct ShapeLeaves {
    std::vector<Coord> atBand; ///< Leaves that may hold a part of the band.
    std::vector<Coord> inside; ///< Leaves inside; only for Tiles::signs.
};

/// Finds the leaves of a shape in a box. `distance` takes index coordinates. Throws ResourceError if they are too many.
template <class Distance>
ShapeLeaves shapeLeaves(const openvdb::BBoxd& box, Tiles tiles, const Distance& distance, const LevelSet& like,
                        const Monitor& monitor) {
    constexpr int kDim = ShapeLeaf::DIM;
    constexpr double kMost = 1e9, kFarthest = 0x1p30;
    if (box.empty()) return {};
    const openvdb::Vec3d size = (box.max() - box.min()) / kDim + openvdb::Vec3d(1);
    const openvdb::Vec3d lower = box.min(), upper = box.max();
    const double farthest = std::max({-lower[0], -lower[1], -lower[2], upper[0], upper[1], upper[2]});
    if (!(size[0] * size[1] * size[2] < kMost && farthest < kFarthest))
        throw ResourceError(
            fmt::format("the box of the shape has about {:.3g} x {:.3g} x {:.3g} voxels of {:.3g}, which "
                        "is too many; make the shape smaller, or the voxels larger",
                        size[0] * kDim, size[1] * kDim, size[2] * kDim, like.voxelSize()));
    const double radius = 0.5 * std::sqrt(3.0) * kDim * like.voxelSize() + static_cast<double>(like.grid->background());
    const Coord first = Coord::floor(lower) & ~(kDim - 1), last = Coord::ceil(upper);
    std::vector<ShapeLeaves> layers(static_cast<size_t>((last.x() - first.x()) / kDim + 1));
    parallelFor(
        layers.size(), 1,
        [&](size_t begin, size_t) {
            const int x = first.x() + kDim * static_cast<int>(begin);
            for (int y = first.y(); y <= last.y(); y += kDim)
                for (int z = first.z(); z <= last.z(); z += kDim) {
                    const double d = distance(openvdb::Vec3d(x, y, z) + openvdb::Vec3d(0.5 * (kDim - 1)));
                    if (std::abs(d) < radius)
                        layers[begin].atBand.emplace_back(x, y, z);
                    else if (d < 0 && tiles == Tiles::signs)
                        layers[begin].inside.emplace_back(x, y, z);
                }
        },
        monitor);
    ShapeLeaves all;
    for (const ShapeLeaves& layer : layers) {
        all.atBand.insert(all.atBand.end(), layer.atBand.begin(), layer.atBand.end());
        all.inside.insert(all.inside.end(), layer.inside.begin(), layer.inside.end());
    }
    return all;
}

/// Samples a shape in a box, in voxels of the grid of a level set.
FloatGrid::Ptr sampledIn(const openvdb::BBoxd& box, Tiles tiles, const Sdf& shape, const LevelSet& like,
                         const Monitor& monitor) {
    auto grid = FloatGrid::create(like.grid->background());
    grid->setTransform(like.grid->transform().copy());
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    grid->setName("surface");
    const auto distance = [&](const openvdb::Vec3d& ijk) {
        const openvdb::Vec3d p = grid->indexToWorld(ijk);
        return shape.distance.at<0>({{p[0], p[1], p[2]}}).value;
    };
    const ShapeLeaves found = shapeLeaves(box, tiles, distance, like, monitor);
    const std::vector<Coord>& origins = found.atBand;
    requireMemory(static_cast<double>(origins.size()) * (sizeof(ShapeLeaf) + ShapeLeaf::SIZE * sizeof(float)),
                  fmt::format("a shape of {:.3g} voxels", static_cast<double>(origins.size()) * ShapeLeaf::SIZE),
                  "make the shape smaller, or the voxels larger");
    std::vector<std::unique_ptr<ShapeLeaf>> leaves(origins.size());
    parallelFor(
        origins.size(), 8,
        [&](size_t begin, size_t end) {
            for (size_t n = begin; n < end; ++n) {
                leaves[n] = std::make_unique<ShapeLeaf>(origins[n], grid->background());
                for (openvdb::Index k = 0; k < ShapeLeaf::SIZE; ++k) {
                    const auto d = static_cast<float>(distance(leaves[n]->offsetToGlobalCoord(k).asVec3d()));
                    const float bound = grid->background();
                    leaves[n]->setValueOnly(k, std::clamp(d, -bound, bound));
                    if (std::abs(d) < bound) leaves[n]->setValueOn(k);
                }
            }
        },
        monitor);
    const bool signs = tiles == Tiles::signs;
    for (auto& leaf : leaves)
        if (!leaf->isEmpty() || (signs && leaf->getFirstValue() < 0)) grid->tree().addLeaf(leaf.release());
    if (signs)
        for (const Coord& origin : found.inside) grid->tree().addTile(1, origin, -grid->background(), false);
    return grid;
}

/// Samples a shape in the box of the active voxels of a level set, beyond which the level set is outside and the shape
/// does not matter. A shape that lies in the box is sampled as by sampledShape().
LevelSet shapeWithin(const LevelSet& levelSet, const Sdf& shape, const Monitor& monitor) {
    const auto active = levelSet.grid->evalActiveVoxelBoundingBox();
    openvdb::BBoxd box(active.min().asVec3d(), active.max().asVec3d());
    if (shape.bounds.finite()) {
        const openvdb::BBoxd own = bandBox(shape, levelSet);
        if (box.isInside(own)) return sampledShape(shape, levelSet, monitor);
    }
    return {sampledIn(box, Tiles::signs, shape, levelSet, monitor), nullptr};
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
    const auto active = like.grid->evalActiveVoxelBoundingBox();
    const auto box =
        shape.bounds.finite() ? bandBox(shape, like) : openvdb::BBoxd(active.min().asVec3d(), active.max().asVec3d());
    const auto grid = sampledIn(box, Tiles::background, shape, like, monitor);
    openvdb::tools::signedFloodFill(grid->tree());
    if (!enclosesSomething(*grid))
        throw ValueError("the shape contains no voxel centre of the level set's grid; use smaller voxels");
    return {grid, nullptr};
}

LevelSet combined(const Sdf& first, const LevelSet& second, Boolean operation, const Monitor& monitor) {
    const bool within = operation == Boolean::intersect;
    const LevelSet shape = within ? shapeWithin(second, first, monitor) : sampledShape(first, second, monitor);
    return combined(shape, second, operation, monitor);
}

LevelSet combined(const LevelSet& first, const Sdf& second, Boolean operation, const Monitor& monitor) {
    const bool within = operation != Boolean::unite;
    const LevelSet shape = within ? shapeWithin(first, second, monitor) : sampledShape(second, first, monitor);
    return combined(first, shape, operation, monitor);
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
