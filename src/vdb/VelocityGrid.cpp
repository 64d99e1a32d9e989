// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/VelocityGrid.h"

#include "DenseBox.h"
#include "FlowSampler.h"
#include "GridTopology.h"
#include "VoxelSize.h"
#include "curlew/base/Error.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>

namespace curlew {

namespace {

using openvdb::Coord;

double voxelFor(const Flow& flow, const VelocityGridOptions& options) {
    if (options.voxel < 0 || !std::isfinite(options.voxel))
        throw ValueError(fmt::format("voxel size {} must be positive", options.voxel));
    if (options.voxel == 0 && options.dim < 1) throw ValueError(fmt::format("dim {} must be at least 1", options.dim));
    const Box& box = flow.domain().box;
    if (!box.finite()) throw ValueError("the domain is infinite; give a box");
    const Vec3d size = box.size();
    if (!(std::min({size[0], size[1], size[2]}) > 0)) throw ValueError("the box is empty");
    return options.voxel > 0 ? options.voxel : std::max({size[0], size[1], size[2]}) / options.dim;
}

/// Returns the range of distances from the wall in which voxels are active, widened by `margin`: where the flow is not
/// zero, or where the moving wall adds velocity.
DistanceRange activeRange(const WallFade& fade, const std::optional<WallVelocity>& moving, double margin) {
    DistanceRange range = fade.range(margin);
    if (!moving) return range;
    const DistanceRange moves = moving->range();
    return {std::min(range.lower, moves.lower - margin), std::max(range.upper, moves.upper + margin)};
}

/// Returns the origins of the leaves that may hold active voxels, in order.
std::vector<Coord> leafOrigins(const Domain& domain, double voxel, const WallFade& fade,
                               const std::optional<WallVelocity>& moving) {
    const double bytes = sizeof(VelocityLeaf) + VelocityLeaf::SIZE * sizeof(openvdb::Vec3s) + 64;
    const auto available = static_cast<double>(availableMemory());
    const auto fitting = static_cast<size_t>(available / (bytes + 3 * sizeof(Coord)));
    const Vec3d origin{{-0.5 * voxel, -0.5 * voxel, -0.5 * voxel}};
    const double volume = voxel * voxel * voxel, bytesPerVolume = sizeof(openvdb::Vec3s) / volume;
    const Vec3d edges = domain.box.size();
    if (!(edges[0] * edges[1] * edges[2] * bytesPerVolume <= available)) { // the domain may be smaller than its box
        const double inDomain = volumeOf(domain);
        requireMemory(inDomain * bytesPerVolume, fmt::format("a velocity grid of {:.3g} voxels", inDomain / volume),
                      "choose larger voxels");
    }
    std::vector<Coord> origins;
    // The faces of a voxel reach its corners, half a diagonal from its centre.
    Domain searched = domain;
    if (domain.wall && domain.wall->side == Side::inside)
        searched.box = domain.box.padded(activeRange(fade, moving, voxel).upper);
    for (const auto& cell :
         coveringCells(searched, origin, voxel * kLeafEdge, activeRange(fade, moving, 0.9 * voxel), fitting))
        origins.emplace_back(cell[0] * kLeafEdge, cell[1] * kLeafEdge, cell[2] * kLeafEdge);
    requireMemory(static_cast<double>(origins.size()) * bytes,
                  fmt::format("a velocity grid of up to {} voxels", origins.size() * VelocityLeaf::SIZE),
                  "choose larger voxels");
    return origins;
}

/// Returns the voxels of a grid. Throws ValueError unless they are cubes along the axes.
Voxels voxelsOfGrid(const openvdb::GridBase& grid) {
    constexpr double kTolerance = 1e-6; // voxels per voxel
    const openvdb::Mat4d toWorld = linearMapOf(grid);
    const Voxels voxels{toWorld(0, 0), {{toWorld(3, 0), toWorld(3, 1), toWorld(3, 2)}}};
    bool cubes = voxels.size > 0;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            cubes = cubes && std::abs(toWorld(i, j) - (i == j ? voxels.size : 0)) <= kTolerance * voxels.size;
    if (!cubes)
        throw ValueError(
            fmt::format("the voxels of {} are not cubes along the axes; resample it first", titleOf(grid)));
    return voxels;
}

/// Resets all voxels outside the mask to inactive background.
void restrictTo(const openvdb::MaskTree::LeafNodeType& mask, VelocityLeaf& leaf) {
    for (openvdb::Index n = 0; n < VelocityLeaf::SIZE; ++n)
        if (!mask.isValueOn(n)) leaf.setValueOff(n, openvdb::Vec3s(0));
}

/// The leaves of a brick: their indices and origins.
struct Brick {
    std::vector<size_t> leaves;
    std::vector<Coord> origins;
};

std::vector<Brick> bricksOf(const std::vector<Coord>& origins) {
    constexpr int kBrick = StaggeredBrick::kLeaves * kLeafEdge;
    std::map<Coord, Brick> byOrigin;
    for (size_t n = 0; n < origins.size(); ++n) {
        Brick& brick = byOrigin[origins[n] & ~(kBrick - 1)];
        brick.leaves.push_back(n);
        brick.origins.push_back(origins[n]);
    }
    std::vector<Brick> bricks;
    bricks.reserve(byOrigin.size());
    for (auto& [origin, brick] : byOrigin) bricks.push_back(std::move(brick));
    return bricks;
}

using Leaves = std::vector<std::unique_ptr<VelocityLeaf>>;

/// Moves the leaves that have active voxels into a tree.
openvdb::Vec3STree::Ptr treeOf(Leaves& leaves) {
    auto tree = std::make_shared<openvdb::Vec3STree>(openvdb::Vec3s(0));
    for (auto& leaf : leaves)
        if (leaf && !leaf->isEmpty()) tree->addLeaf(leaf.release());
    return tree;
}

/// Makes a tree of leaves at the origins, with velocities from a source.
openvdb::Vec3STree::Ptr treeFrom(const VelocitySource& source, const std::vector<Coord>& origins,
                                 const FlowOnVoxels& sampled, const openvdb::MaskTree* mask, const Monitor& monitor) {
    Leaves leaves(origins.size());
    std::vector<VelocityLeaf*> all(origins.size());
    parallelFor(origins.size(), 64, [&](size_t begin, size_t end) {
        for (size_t n = begin; n < end; ++n) {
            leaves[n] = std::make_unique<VelocityLeaf>(origins[n], openvdb::Vec3s(0));
            all[n] = leaves[n].get();
        }
    });
    sampleCollocated(sampled, source, all, monitor);
    if (mask)
        for (VelocityLeaf* leaf : all) restrictTo(*mask->probeConstLeaf(leaf->origin()), *leaf);
    return treeOf(leaves);
}

/// Makes a tree of leaves at the origins and fills it in parallel. Omits leaves without active voxels.
openvdb::Vec3STree::Ptr filledTree(const std::vector<Coord>& origins, const FlowOnVoxels& sampled, Layout layout,
                                   const openvdb::MaskTree* mask, const Monitor& monitor) {
    Leaves leaves(origins.size());
    const std::vector<Brick> bricks = bricksOf(origins);
    const auto fill = [&](const Brick& brick) {
        std::optional<StaggeredBrick> staggered;
        if (layout == Layout::staggered) staggered.emplace(sampled, brick.origins);
        for (const size_t n : brick.leaves) {
            auto leaf = std::make_unique<VelocityLeaf>(origins[n], openvdb::Vec3s(0));
            if (staggered)
                staggered->sample(*leaf);
            else
                sampleCollocated(sampled, *leaf);
            if (mask) restrictTo(*mask->probeConstLeaf(leaf->origin()), *leaf);
            if (!leaf->isEmpty()) leaves[n] = std::move(leaf);
        }
    };
    parallelFor(
        bricks.size(), 1,
        [&](size_t begin, size_t end) {
            for (size_t k = begin; k < end; ++k) fill(bricks[k]);
        },
        monitor);
    return treeOf(leaves);
}

/// Adds the velocity of displaced air, which is given on the faces of voxels, and activates the voxels where it is not
/// zero. The velocity at the centre of a voxel is the mean of those on opposite faces.
void addDisplaced(const openvdb::Vec3STree& faces, Layout layout, const openvdb::MaskTree* mask,
                  openvdb::Vec3STree& tree) {
    std::vector<const VelocityLeaf*> from;
    std::vector<VelocityLeaf*> to;
    for (auto leaf = faces.cbeginLeaf(); leaf; ++leaf) {
        if (leaf->isEmpty() || (mask && !mask->probeConstLeaf(leaf->origin()))) continue;
        from.push_back(&*leaf);
        to.push_back(tree.touchLeaf(leaf->origin()));
    }
    parallelFor(from.size(), 8, [&](size_t begin, size_t end) {
        const openvdb::tree::ValueAccessor<const openvdb::Vec3STree, false> around(faces);
        for (size_t n = begin; n < end; ++n)
            for (auto value = from[n]->cbeginValueOn(); value; ++value) {
                const Coord ijk = value.getCoord();
                if (mask && !mask->isValueOn(ijk)) continue;
                openvdb::Vec3s v = *value;
                for (int axis = 0; axis < 3 && layout == Layout::collocated; ++axis) {
                    Coord above = ijk;
                    ++above[axis];
                    v[axis] = 0.5f * (v[axis] + around.getValue(above)[axis]);
                }
                to[n]->setValueOn(value.pos(), to[n]->getValue(value.pos()) + v);
            }
    });
}

} // namespace

Voxels voxelsOf(const Flow& flow, const VelocityGridOptions& options) {
    return options.mask ? voxelsOfGrid(*options.mask) : Voxels{.size = voxelFor(flow, options)};
}

openvdb::Vec3SGrid::Ptr velocityGrid(const Flow& flow, const VelocityGridOptions& options, const Monitor& monitor) {
    if (!(options.wallFade >= 1))
        throw ValueError(fmt::format("the wall fade, {} voxels, must be at least 1", options.wallFade));
    if (options.layout == Layout::staggered && options.source)
        throw ValueError("a staggered grid is made of potentials, not of velocities from a source");
    if (options.layout == Layout::staggered && !flow.divergenceFree())
        throw ValueError(
            flow.uniformSpeed() > 0 || flow.preservesArea()
                ? "a normalised flow, or one that preserves area on level sets, is not divergence-free, and a "
                  "staggered "
                  "grid cannot make it so; sample it collocated"
                : "a flow without potentials (a velocity grid, a gradient) cannot be sampled on a staggered grid; "
                  "sample it collocated, or make the potentials of the grid (-flow exact=1)");
    const Voxels voxels = voxelsOf(flow, options);
    const double voxel = voxels.size;
    if (options.displaced && voxelsOfGrid(*options.displaced) != voxels)
        throw ValueError("the displaced air is not given on the voxels of the grid");
    openvdb::MaskTree::Ptr mask;
    std::vector<Coord> origins;
    // A mask alone decides which voxels are active.
    constexpr double kFar = 1e300;
    constexpr Box kEverywhere{{{-kFar, -kFar, -kFar}}, {{kFar, kFar, kFar}}};
    Domain domain = flow.domain();
    domain.box = domain.box.padded(kSideRounding * voxel);
    Flow sampled = flow.within(options.mask ? Domain{kEverywhere, std::nullopt} : domain);
    if (options.mask) {
        mask = activeVoxels(*options.mask);
        const double bytes = sizeof(VelocityLeaf) + VelocityLeaf::SIZE * sizeof(openvdb::Vec3s) + sizeof(Coord);
        requireMemory(bytes * mask->leafCount(),
                      fmt::format("a velocity grid of {:.3g} voxels", static_cast<double>(mask->activeVoxelCount())),
                      "use a mask with fewer active voxels");
        for (auto leaf = mask->cbeginLeaf(); leaf; ++leaf) origins.push_back(leaf->origin());
    }
    const WallFade fade(sampled.domain(), voxel, options.wallFade);
    const std::optional<WallVelocity> moving = options.displaced ? std::nullopt : options.moving;
    if (!options.mask) origins = leafOrigins(domain, voxel, fade, moving);
    requireVoxel(voxel);

    const FlowOnVoxels onVoxels{sampled, voxels, fade, moving ? &*moving : nullptr}; // refers to `sampled`
    if (options.layout == Layout::staggered) sampled = potentialsToFade(onVoxels);
    const auto tree = options.source ? treeFrom(options.source(flow), origins, onVoxels, mask.get(), monitor)
                                     : filledTree(origins, onVoxels, options.layout, mask.get(), monitor);
    if (options.displaced) addDisplaced(options.displaced->tree(), options.layout, mask.get(), *tree);
    auto grid = openvdb::Vec3SGrid::create(tree);
    grid->setTransform(options.mask ? options.mask->transform().copy()
                                    : openvdb::math::Transform::createLinearTransform(voxel));
    grid->setName("vel");
    grid->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
    if (options.layout == Layout::staggered) grid->setGridClass(openvdb::GRID_STAGGERED);
    return grid;
}

} // namespace curlew
