// SPDX-License-Identifier: Apache-2.0
#include "SolidSigns.h"

#include "curlew/base/Parallel.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace curlew {

namespace {

using openvdb::Coord;
using Leaf = openvdb::FloatTree::LeafNodeType;
using Access = openvdb::tree::ValueAccessor<const openvdb::FloatTree>;

/// The voxels of a narrow band in layers, from the surface outwards. A layer holds the active voxels with absolute
/// values from one bound to below the next, as they are when this is made.
class BandLayers {
  public:
    /// `bounds`: increasing, at least one. Voxels below the first and from the last one on are in no layer.
    BandLayers(openvdb::FloatTree& band, const std::vector<float>& bounds) : mLayers(bounds.size() - 1) {
        band.getNodes(mLeaves);
        mSorted.resize(mLeaves.size());
        parallelFor(mLeaves.size(), kGrain, [&](size_t begin, size_t end) {
            for (size_t n = begin; n < end; ++n) sort(*mLeaves[n], bounds, mSorted[n]);
        });
    }

    size_t count() const { return mLayers; }

    /// For the voxels of a layer, calls find(leaf, their positions in the leaf, found) on all threads, which adds to
    /// the vector `found`. Then calls use(one) for all that was found, in an order that does not depend on the threads.
    template <class Found, class Find, class Use>
    void forEach(size_t layer, const Find& find, const Use& use, const Monitor& monitor) const {
        std::vector<std::vector<Found>> found((mLeaves.size() + kGrain - 1) / kGrain);
        parallelFor(
            mLeaves.size(), kGrain,
            [&](size_t begin, size_t end) {
                for (size_t n = begin; n < end; ++n)
                    if (const auto voxels = mSorted[n].of(layer); !voxels.empty())
                        find(*mLeaves[n], voxels, found[begin / kGrain]);
            },
            monitor);
        for (const auto& some : found)
            for (const Found& one : some) use(one);
    }

  private:
    static constexpr size_t kGrain = 16; ///< In leaves.

    /// The voxels of a leaf.
    struct Sorted {
        std::vector<uint16_t> begins, voxels; ///< The first of each layer, and the number of all.
        std::span<const uint16_t> of(size_t layer) const {
            return std::span(voxels).subspan(begins[layer], size_t{begins[layer + 1]} - begins[layer]);
        }
    };

    static void sort(const Leaf& leaf, const std::vector<float>& bounds, Sorted& sorted) {
        const auto forLayered = [&](const auto& use) {
            for (auto value = leaf.cbeginValueOn(); value; ++value) {
                const auto above = std::upper_bound(bounds.begin(), bounds.end(), std::abs(*value));
                if (above != bounds.begin() && above != bounds.end())
                    use(static_cast<size_t>(above - bounds.begin()) - 1, static_cast<uint16_t>(value.pos()));
            }
        };
        sorted.begins.assign(bounds.size(), 0);
        forLayered([&](size_t layer, uint16_t) { ++sorted.begins[layer + 1]; });
        std::partial_sum(sorted.begins.begin(), sorted.begins.end(), sorted.begins.begin());
        sorted.voxels.resize(sorted.begins.back());
        std::vector<uint16_t> next = sorted.begins;
        forLayered([&](size_t layer, uint16_t voxel) { sorted.voxels[next[layer]++] = voxel; });
    }

    size_t mLayers;
    std::vector<Leaf*> mLeaves;
    std::vector<Sorted> mSorted;
};

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
