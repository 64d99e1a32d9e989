// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Batch.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>

namespace curlew {

class LatticeMemo;

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

  private:
    /// Fills a batch with the combinations from `begin` on, line by line.
    void fill(size_t begin, PointBatch& points) const {
        const auto x = coordinates[0], y = coordinates[1], z = coordinates[2];
        const auto count = static_cast<size_t>(points.size);
        size_t line = begin / z.size(), from = begin % z.size(), i = line / y.size(), j = line % y.size();
        for (size_t n = 0; n < count; from = 0) {
            const size_t length = std::min(z.size() - from, count - n);
            const auto fillLine = [&](size_t numbers) {
                std::fill_n(&points.c[0][n], numbers, x[i]);
                std::fill_n(&points.c[1][n], numbers, y[j]);
                std::copy_n(&z[from], numbers, &points.c[2][n]);
            };
            constexpr size_t kLeaf = 8; // a line of a VDB leaf: a length that the compiler knows is faster
            if (length == kLeaf)
                fillLine(kLeaf);
            else
                fillLine(length);
            n += length;
            if (++j < y.size()) continue;
            j = 0;
            ++i;
        }
    }
    /// Fills a batch with the combinations of these numbers.
    void fill(std::span<const uint32_t> numbers, PointBatch& points) const {
        const auto& [x, y, z] = coordinates;
        size_t first = 0, end = 0; // the combinations on the line of the last position
        Vec3d p;
        for (size_t i = 0; i < numbers.size(); ++i) {
            const size_t n = numbers[i];
            if (n >= end || n < first) {
                const size_t row = n / z.size();
                first = row * z.size();
                end = first + z.size();
                p[0] = x[row / y.size()];
                p[1] = y[row % y.size()];
            }
            p[2] = z[n - first];
            points.set(static_cast<int>(i), p);
        }
    }
};

/// Some of the positions of a lattice.
struct LatticeBatch {
    PointBatch points;
    size_t first = 0;                      ///< The number of the first one among the positions of the lattice.
    std::span<const uint32_t> chosen = {}; ///< Their numbers among all combinations; empty: consecutive, from `first`.

    /// Returns the number of position i among all combinations.
    size_t number(int i) const {
        const auto n = static_cast<size_t>(i);
        return chosen.empty() ? first + n : chosen[n];
    }
};

template <class Use>
void PointLattice::forEachBatch(const Use& use) const {
    LatticeBatch batch;
    for (; batch.first < size(); batch.first += kBatch) {
        const size_t count = std::min(size() - batch.first, size_t{kBatch});
        batch.points.size = static_cast<int>(count);
        if (chosen.empty()) {
            fill(batch.first, batch.points);
        } else {
            batch.chosen = chosen.subspan(batch.first, count);
            fill(batch.chosen, batch.points);
        }
        use(std::as_const(batch));
    }
}

} // namespace curlew
