// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/ScalarGrids.h"

#include "GridTopology.h"
#include "WallFade.h"
#include "curlew/base/Error.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/format.h>
#include <openvdb/tools/ValueTransformer.h>
#include <openvdb/tree/LeafManager.h>

#include <algorithm>
#include <array>
#include <functional>
#include <memory>

namespace curlew {

namespace {

using Values = std::array<float, kBatch>;

/// Makes a grid on the active voxels of `where`, filled by `evaluate` at their centres.
openvdb::FloatGrid::Ptr filledGrid(const openvdb::GridBase& where, const std::string& name,
                                   const std::function<void(const PointBatch&, Values&)>& evaluate,
                                   const Monitor& monitor) {
    const auto topology = activeVoxels(where);
    requireMemory(
        static_cast<double>(topology->leafCount()) *
            (sizeof(openvdb::FloatTree::LeafNodeType) + sizeof(float) * openvdb::FloatTree::LeafNodeType::SIZE),
        fmt::format("the grid '{}' of {:.3g} voxels", name, static_cast<double>(topology->activeVoxelCount())),
        "choose larger voxels");
    auto grid =
        openvdb::FloatGrid::create(std::make_shared<openvdb::FloatTree>(*topology, 0.0f, openvdb::TopologyCopy()));
    grid->setTransform(where.transform().copy());
    grid->setName(name);
    const openvdb::tree::LeafManager<openvdb::FloatTree> leaves(grid->tree());
    const auto fill = [&](openvdb::FloatTree::LeafNodeType& leaf) {
        PointBatch points;
        std::array<openvdb::Index, kBatch> offset;
        Values values;
        const auto flush = [&] {
            evaluate(points, values);
            for (int i = 0; i < points.size; ++i)
                leaf.setValueOnly(offset[static_cast<size_t>(i)], values[static_cast<size_t>(i)]);
            points.size = 0;
        };
        for (auto voxel = leaf.cbeginValueOn(); voxel; ++voxel) {
            const auto p = grid->transform().indexToWorld(voxel.getCoord());
            offset[static_cast<size_t>(points.size)] = voxel.pos();
            points.push({{p[0], p[1], p[2]}});
            if (points.full()) flush();
        }
        if (points.size > 0) flush();
    };
    parallelFor(
        leaves.leafCount(), 8,
        [&](size_t begin, size_t end) {
            for (size_t n = begin; n < end; ++n) fill(leaves.leaf(n));
        },
        monitor);
    return grid;
}

} // namespace

openvdb::MaskTree::Ptr activeVoxels(const openvdb::GridBase& grid) {
    openvdb::MaskTree::Ptr topology;
    const bool known = grid.apply<openvdb::GridTypes>([&](const auto& typed) {
        topology = std::make_shared<openvdb::MaskTree>(typed.tree(), false, true, openvdb::TopologyCopy());
    });
    if (!known) throw ValueError(fmt::format("grid '{}' of type {} cannot be a mask", grid.getName(), grid.type()));
    using Leaf = openvdb::MaskTree::LeafNodeType;
    const auto tiled = static_cast<double>(topology->activeVoxelCount() - topology->activeLeafVoxelCount());
    const double leaves = topology->leafCount() + tiled / Leaf::SIZE;
    requireMemory(leaves * (sizeof(Leaf) + sizeof(Leaf*)),
                  fmt::format("the mask of the {:.3g} active voxels of grid '{}'",
                              static_cast<double>(topology->activeVoxelCount()), grid.getName()),
                  "use a grid with fewer active voxels");
    topology->voxelizeActiveTiles();
    return topology;
}

openvdb::FloatGrid::Ptr sampledGrid(const ScalarField& field, const openvdb::GridBase& where, const std::string& name,
                                    const Monitor& monitor) {
    return filledGrid(
        where, name,
        [&](const PointBatch& points, Values& values) {
            JetBatch<float, 0> jets;
            field.eval(points, jets);
            values = jets.c[0];
        },
        monitor);
}

openvdb::FloatGrid::Ptr densityGrid(const Domain& domain, const openvdb::GridBase& where, const Monitor& monitor) {
    const double edge = 2 * where.transform().voxelSize()[0];
    auto grid = filledGrid(
        where, "density",
        [&](const PointBatch& points, Values& values) {
            if (!domain.wall) return values.fill(1.0f);
            JetBatch<double, 0> d;
            wallDistances(domain, points, d);
            for (size_t i = 0; i < values.size(); ++i)
                values[i] = static_cast<float>(std::clamp(-beyondWall(domain.wall->side, d.c[0][i]) / edge, 0.0, 1.0));
        },
        monitor);
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    return grid;
}

openvdb::Vec3SGrid::ConstPtr vectorsOf(const openvdb::GridBase::ConstPtr& grid) {
    if (auto floats = openvdb::GridBase::grid<openvdb::Vec3SGrid>(grid)) return floats;
    const auto doubles = openvdb::GridBase::grid<openvdb::Vec3DGrid>(grid);
    if (!doubles) return nullptr;
    const auto tree = std::make_shared<openvdb::Vec3STree>(doubles->tree(), openvdb::Vec3s(doubles->background()),
                                                           openvdb::TopologyCopy());
    const auto floats = openvdb::Vec3SGrid::create(tree);
    floats->insertMeta(*doubles);
    floats->setTransform(doubles->transform().copy());
    openvdb::tools::foreach (floats->beginValueOn(), [&doubles](const openvdb::Vec3SGrid::ValueOnIter& value) {
        value.setValue(openvdb::Vec3s(doubles->tree().getValue(value.getCoord())));
    });
    return floats;
}

openvdb::FloatGrid::Ptr componentOf(const openvdb::Vec3SGrid& grid, int component, const std::string& name) {
    const auto tree = std::make_shared<openvdb::FloatTree>(grid.tree(), 0.0f, openvdb::TopologyCopy());
    auto values = openvdb::FloatGrid::create(tree);
    values->setTransform(grid.transform().copy());
    values->setName(name);
    values->setGridClass(openvdb::GRID_FOG_VOLUME);
    values->setSaveFloatAsHalf(grid.saveFloatAsHalf());
    openvdb::tools::foreach (values->beginValueOn(), [&grid, component](const openvdb::FloatGrid::ValueOnIter& value) {
        value.setValue(grid.tree().getValue(value.getCoord())[component]);
    });
    return values;
}

} // namespace curlew
