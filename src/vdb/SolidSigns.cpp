// SPDX-License-Identifier: Apache-2.0
#include "SolidSigns.h"

#include "curlew/base/Parallel.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace curlew {

namespace {

using openvdb::Coord;
using Leaf = openvdb::FloatTree::LeafNodeType;
using Access = openvdb::tree::ValueAccessor<const openvdb::FloatTree>;

/// Walks from a voxel towards the surface until a voxel whose sign is known.
Coord nearOne(Coord at, float near, const Access& distance) {
    float here = std::abs(distance.getValue(at));
    while (here >= near) {
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
    std::vector<Leaf*> leaves;
    grid.tree().getNodes(leaves);
    const openvdb::FloatTree before(grid.tree()); // read from a copy while signs are written to the grid
    const auto near = static_cast<float>(kNearSurface * grid.voxelSize()[0]);
    parallelFor(
        leaves.size(), 16,
        [&](size_t begin, size_t end) {
            const Access distance(before);
            for (size_t n = begin; n < end; ++n)
                for (auto value = leaves[n]->beginValueOn(); value; ++value)
                    if (*value >= near && distance.getValue(nearOne(value.getCoord(), near, distance)) < 0)
                        value.setValue(-*value);
        },
        monitor);
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
