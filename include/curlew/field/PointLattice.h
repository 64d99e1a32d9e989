// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Batch.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>

namespace curlew {

class LatticeMemo;

class LatticeBatch;

/// Positions on a rectilinear lattice: combinations of coordinates along three axes, in world units. Refers to the
/// coordinates. The order of the positions has z fastest.
struct PointLattice {
    std::array<std::span<const double>, 3> coordinates;
    /// The numbers of the positions among all combinations, ascending; empty: all combinations.
    std::span<const uint32_t> chosen = {};
    /// Where fields keep what they have prepared for these coordinates (ScalarField::onLattice); may be nullptr.
    LatticeMemo* memo = nullptr;

    /// The number of all combinations.
    size_t combinations() const { return coordinates[0].size() * coordinates[1].size() * coordinates[2].size(); }
    size_t size() const { return chosen.empty() ? combinations() : chosen.size(); }

    /// Calls use(batch) with all positions in batches (LatticeBatch).
    template <class Use>
    void forEachBatch(const Use& use) const;
};

/// Some of the positions of a lattice, up to kBatch. Refers to the lattice. Not for several threads at a time.
class LatticeBatch {
  public:
    /// The first batch of a lattice.
    explicit LatticeBatch(const PointLattice& lattice) : mLattice(lattice) { start(0); }
    /// Becomes the batch after this one, which is empty at the end.
    void next() { start(mFirst + mSize); }

    int size() const { return static_cast<int>(mSize); }
    /// The number of the first one among the positions of the lattice.
    size_t first() const { return mFirst; }
    /// Returns the number of position i among all combinations.
    size_t number(int i) const {
        const size_t n = mFirst + static_cast<size_t>(i);
        return mLattice.chosen.empty() ? n : mLattice.chosen[n];
    }

    /// Calls use(from, number, length) with each run of positions whose numbers among all combinations are consecutive:
    /// `length` of them from position `from` on, with numbers from `number` on.
    template <class Use>
    void forEachRun(const Use& use) const {
        if (mLattice.chosen.empty()) return use(size_t{0}, mFirst, mSize);
        const auto numbers = mLattice.chosen.subspan(mFirst, mSize);
        for (size_t from = 0, end = 0; from < mSize; from = end) {
            const auto inRun = [&](size_t n) { return n < mSize && numbers[n] - numbers[from] == n - from; };
            if (inRun(mSize - 1)) end = mSize;
            constexpr size_t kStep = 8;
            while (inRun(end + kStep - 1)) end += kStep;
            while (inRun(end)) ++end;
            use(from, size_t{numbers[from]}, end - from);
        }
    }

    /// The positions. They are computed when they are first asked for.
    const PointBatch& points() const {
        if (mPoints.size == 0) forEachRun([&](size_t, size_t number, size_t length) { append(number, length); });
        return mPoints;
    }

  private:
    void start(size_t first) {
        mFirst = first;
        mSize = std::min(mLattice.size() - first, size_t{kBatch});
        mPoints.size = 0;
    }

    /// Appends `count` combinations, from `number` on.
    void append(size_t number, size_t count) const {
        const auto x = mLattice.coordinates[0], y = mLattice.coordinates[1], z = mLattice.coordinates[2];
        for (size_t length; count > 0; count -= length, number += length) {
            for (; number >= mLine + z.size(); mLine += z.size()) {
                if (++mJ < y.size()) continue;
                mJ = 0;
                ++mI;
            }
            const size_t from = number - mLine;
            length = std::min(z.size() - from, count);
            const auto appendLine = [&, to = static_cast<size_t>(mPoints.size)](size_t numbers) {
                std::fill_n(&mPoints.c[0][to], numbers, x[mI]);
                std::fill_n(&mPoints.c[1][to], numbers, y[mJ]);
                std::copy_n(&z[from], numbers, &mPoints.c[2][to]);
            };
            constexpr size_t kLeaf = 8; // a line of a VDB leaf: a length that the compiler knows is faster
            if (length == kLeaf)
                appendLine(kLeaf);
            else
                appendLine(length);
            mPoints.size += static_cast<int>(length);
        }
    }

    const PointLattice& mLattice;
    size_t mFirst = 0, mSize = 0;
    mutable PointBatch mPoints;
    // The line of combinations along z of the last position that was computed: the number of the first of them, and of
    // their coordinates along x and y.
    mutable size_t mLine = 0, mI = 0, mJ = 0;
};

template <class Use>
void PointLattice::forEachBatch(const Use& use) const {
    for (LatticeBatch batch(*this); batch.size() > 0; batch.next()) use(std::as_const(batch));
}

} // namespace curlew
