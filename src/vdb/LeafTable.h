// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openvdb/Types.h>

#include <array>
#include <cstdint>
#include <vector>

namespace curlew {

/// The numbers of leaves by their coordinates (leaf origin / 8): a hash table of bricks of 4 x 4 x 4 leaves with open
/// addressing. Unlike the nodes of a VDB tree, what lookups at scattered positions read fits into the processor's inner
/// caches. Immutable, safe to share between threads.
class LeafTable {
  public:
    static constexpr int32_t kNone = -1;

    LeafTable() : LeafTable(std::vector<openvdb::Coord>{}) {}
    /// Leaf i gets the number i. The coordinates must differ.
    explicit LeafTable(const std::vector<openvdb::Coord>& leaves) {
        reserve(16);
        for (size_t i = 0; i < leaves.size(); ++i)
            brickFor(brickOf(leaves[i]))[place(leaves[i])] = static_cast<int32_t>(i);
    }

    /// Returns the number of a leaf, or kNone.
    int32_t find(const openvdb::Coord& leaf) const {
        const Slot& slot = mSlots[slotOf(brickOf(leaf))];
        return slot.number == kNone ? kNone : mBricks[static_cast<size_t>(slot.number)][place(leaf)];
    }

  private:
    static constexpr int kLog2Edge = 2, kEdge = 1 << kLog2Edge;
    using Brick = std::array<int32_t, kEdge * kEdge * kEdge>;
    struct Slot {
        openvdb::Coord brick;
        int32_t number = kNone;
    };

    static openvdb::Coord brickOf(const openvdb::Coord& leaf) {
        return {leaf[0] >> kLog2Edge, leaf[1] >> kLog2Edge, leaf[2] >> kLog2Edge};
    }
    static size_t place(const openvdb::Coord& leaf) {
        constexpr int kMask = kEdge - 1;
        const int n = ((leaf[0] & kMask) * kEdge + (leaf[1] & kMask)) * kEdge + (leaf[2] & kMask);
        return static_cast<size_t>(n);
    }

    /// Returns the slot of a brick, or the free one in which it belongs.
    size_t slotOf(const openvdb::Coord& brick) const {
        // Odd multipliers give neighbours different slots.
        constexpr uint64_t kX = 0x9E3779B97F4A7C15, kY = 0xC2B2AE3D27D4EB4F, kZ = 0x165667B19E3779F9;
        const uint64_t hash = static_cast<uint64_t>(brick[0]) * kX ^ static_cast<uint64_t>(brick[1]) * kY ^
                              static_cast<uint64_t>(brick[2]) * kZ;
        const size_t mask = mSlots.size() - 1;
        size_t k = static_cast<size_t>(hash >> 32) & mask;
        while (mSlots[k].number != kNone && mSlots[k].brick != brick) k = (k + 1) & mask;
        return k;
    }

    Brick& brickFor(const openvdb::Coord& brick) {
        if (2 * mBricks.size() >= mSlots.size()) reserve(2 * mSlots.size());
        Slot& slot = mSlots[slotOf(brick)];
        if (slot.number == kNone) {
            slot = {brick, static_cast<int32_t>(mBricks.size())};
            mBricks.emplace_back().fill(kNone);
        }
        return mBricks[static_cast<size_t>(slot.number)];
    }

    /// Makes a table of so many slots, a power of two.
    void reserve(size_t slots) {
        std::vector<Slot> former(slots);
        former.swap(mSlots);
        for (const Slot& slot : former)
            if (slot.number != kNone) mSlots[slotOf(slot.brick)] = slot;
    }

    std::vector<Slot> mSlots; ///< At most half of them are used.
    std::vector<Brick> mBricks;
};

} // namespace curlew
