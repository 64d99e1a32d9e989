// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace curlew {

/// The voxels of a narrow band in layers, from the surface outwards. A layer holds the active voxels with absolute
/// values from one bound to below the next, as they are when this is made.
class BandLayers {
  public:
    using Leaf = openvdb::FloatTree::LeafNodeType;

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

} // namespace curlew
