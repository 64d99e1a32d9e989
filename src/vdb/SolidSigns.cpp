// SPDX-License-Identifier: Apache-2.0
#include "SolidSigns.h"

#include "BandLayers.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/Openvdb.h"

#include <cmath>
#include <vector>

namespace curlew {

namespace {

using openvdb::Coord;
using Leaf = openvdb::FloatTree::LeafNodeType;
using Access = openvdb::tree::ValueAccessor<const openvdb::FloatTree>;

/// Walks from a voxel towards the surface until a voxel closer than `known`.
Coord nearOne(Coord at, float known, const Access& distance) {
    float here = std::abs(distance.getValue(at));
    while (here >= known) {
        Coord best = at;
        for (int axis = 0; axis < 3; ++axis)
            for (const int by : {-1, 1}) {
                Coord next = at;
                next[axis] += by;
                if (const float d = std::abs(distance.getValue(next)); d < here) here = d, best = next;
            }
        if (best == at) break;
        at = best;
    }
    return at;
}

} // namespace

void spreadSigns(openvdb::FloatGrid& grid, const Monitor& monitor) {
    const auto voxel = static_cast<float>(grid.voxelSize()[0]);
    // Each layer is a voxel wide, so most walks end after one or two steps.
    std::vector<float> bounds{static_cast<float>(kNearSurface) * voxel};
    while (bounds.back() <= grid.background()) bounds.push_back(bounds.back() + voxel);
    const BandLayers layers(grid.tree(), bounds);
    for (size_t k = 0; k < layers.count(); ++k)
        layers.forEach<float*>(
            k,
            [&](Leaf& leaf, std::span<const uint16_t> voxels, std::vector<float*>& inside) {
                const Access distance(grid.tree());
                for (const uint16_t n : voxels)
                    if (distance.getValue(nearOne(leaf.offsetToGlobalCoord(n), bounds[k], distance)) < 0)
                        inside.push_back(&leaf.buffer().data()[n]);
            },
            [](float* value) { *value = -*value; }, monitor);
}

bool signsAgree(const openvdb::FloatGrid& grid, const Monitor& monitor) {
    std::vector<const Leaf*> leaves;
    grid.tree().getNodes(leaves);
    const auto apart = static_cast<float>(1.02 * grid.voxelSize()[0]); // 0.02 for rounding
    const auto differing = [&](const Leaf& leaf, const Access& distance) {
        size_t count = 0;
        for (auto value = leaf.cbeginValueOn(); value; ++value)
            for (int axis = 0; axis < 3; ++axis) {
                Coord next = value.getCoord();
                ++next[axis];
                float there = 0;
                if (distance.probeValue(next, there) && (*value < 0) != (there < 0))
                    count += std::abs(*value) + std::abs(there) > apart;
            }
        return count;
    };
    return parallelSum(
               leaves.size(), 16,
               [&](size_t begin, size_t end) {
                   const Access distance(grid.tree());
                   size_t count = 0;
                   for (size_t n = begin; n < end; ++n) count += differing(*leaves[n], distance);
                   return count;
               },
               monitor) == 0;
}

} // namespace curlew
