// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Arithmetic.h"
#include "curlew/math/Vec.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <vector>

namespace curlew {

/// The numbers of leaves by their coordinates (leaf origin / 8): a hash table of bricks of 4 x 4 x 4 leaves with open
/// addressing. Unlike the nodes of a VDB tree, what lookups at scattered positions read fits into the processor's inner
/// caches. Coordinates are integers of at most 2^27, as double, so that keys can be computed in SIMD lanes. Immutable,
/// safe to share between threads.
class LeafTable {
  public:
    static constexpr int32_t kNone = -1;

    /// Where a leaf is in the table. T is double or lanes of double; all are integers.
    template <class T>
    struct Key {
        T column, layer; ///< These identify its brick.
        T slot;          ///< The slot of the brick, or the first of those where it may be.
        T place;         ///< Of the leaf in the brick.
    };

    LeafTable() : LeafTable(std::vector<Vec3d>{}) {}
    /// Leaf i gets the number i. The coordinates must differ.
    explicit LeafTable(const std::vector<Vec3d>& leaves) {
        std::vector<std::array<double, 2>> bricks;
        for (const Vec3d& leaf : leaves) {
            const Key<double> key = keyOf(leaf, 1);
            bricks.push_back({key.column, key.layer});
        }
        std::sort(bricks.begin(), bricks.end());
        const auto different = static_cast<size_t>(std::unique(bricks.begin(), bricks.end()) - bricks.begin());
        mSlots.resize(std::bit_ceil(2 * different + 1));
        mBricks.reserve(different);
        for (size_t i = 0; i < leaves.size(); ++i) {
            const Key<double> key = keyOf(leaves[i]);
            Slot& slot = mSlots[slotOf(key)];
            if (slot.number == kNone) {
                slot = {key.column, key.layer, static_cast<int32_t>(mBricks.size())};
                mBricks.emplace_back().fill(kNone);
            }
            mBricks[static_cast<size_t>(slot.number)][static_cast<size_t>(key.place)] = static_cast<int32_t>(i);
        }
    }

    double slots() const { return static_cast<double>(mSlots.size()); }

    /// Returns the key of a leaf in a table with so many slots.
    template <class T>
    static Key<T> keyOf(const Vec<T, 3>& leaf, double slots) {
        constexpr double kColumns = 0x1p26; // more than bricks along an axis
        Vec<T, 3> brick, within;
        for (int axis = 0; axis < 3; ++axis) {
            brick[axis] = floor(leaf[axis] * T(1.0 / kEdge));
            within[axis] = mulAdd(brick[axis], T(-kEdge), leaf[axis]);
        }
        // The fractions of multiples of these irrational numbers are evenly distributed: powers of the inverse of the
        // solution of x⁴ = x + 1.
        const T sum = mulAdd(brick[0], T(0.8191725133961645),
                             mulAdd(brick[1], T(0.6710436067037893), brick[2] * T(0.5497004779019703)));
        return {mulAdd(brick[0], T(kColumns), brick[1]), brick[2], floor((sum - floor(sum)) * T(slots)),
                mulAdd(mulAdd(within[0], T(kEdge), within[1]), T(kEdge), within[2])};
    }
    Key<double> keyOf(const Vec3d& leaf) const { return keyOf(leaf, slots()); }

    /// Returns the number of a leaf, or kNone.
    int32_t find(const Key<double>& key) const {
        const Slot& slot = mSlots[slotOf(key)];
        return slot.number == kNone ? kNone : mBricks[static_cast<size_t>(slot.number)][static_cast<size_t>(key.place)];
    }

  private:
    static constexpr int kEdge = 4;
    using Brick = std::array<int32_t, kEdge * kEdge * kEdge>;
    struct Slot {
        double column = std::numeric_limits<double>::quiet_NaN(), layer = 0;
        int32_t number = kNone;
    };

    /// Returns the slot of a key's brick, or the free one in which it belongs.
    size_t slotOf(const Key<double>& key) const {
        auto k = static_cast<size_t>(key.slot);
        while (mSlots[k].number != kNone && !(mSlots[k].column == key.column && mSlots[k].layer == key.layer))
            k = (k + 1) & (mSlots.size() - 1);
        return k;
    }

    std::vector<Slot> mSlots; ///< A power of two, of which at most half are used.
    std::vector<Brick> mBricks;
};

} // namespace curlew
