// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Batch.h"

#include <algorithm>
#include <span>
#include <utility>

namespace curlew {

/// Positions on a rectilinear lattice: all combinations of coordinates along three axes, in world units. Refers to the
/// coordinates. The order of the positions, and of values at them, has z fastest.
struct PointLattice {
    std::array<std::span<const double>, 3> coordinates;

    size_t size() const { return coordinates[0].size() * coordinates[1].size() * coordinates[2].size(); }

    /// Calls use(points, first) with all positions in batches; `first` is the number of the first position of a batch.
    template <class Use>
    void forEachBatch(const Use& use) const {
        PointBatch points;
        size_t first = 0;
        const auto flush = [&] {
            if (points.size > 0) use(std::as_const(points), first);
            first += static_cast<size_t>(points.size);
            points.size = 0;
        };
        for (const double x : coordinates[0]) {
            auto& xs = points.c[0];
            std::fill(xs.begin() + points.size, xs.end(), x);
            bool filled = points.size == 0; // all x of a batch
            for (const double y : coordinates[1])
                for (auto z = coordinates[2].begin(); z != coordinates[2].end();) {
                    const auto count = std::min(coordinates[2].end() - z, std::ptrdiff_t{kBatch - points.size});
                    std::fill_n(points.c[1].begin() + points.size, count, y);
                    std::copy_n(z, count, points.c[2].begin() + points.size);
                    points.size += static_cast<int>(count);
                    z += count;
                    if (!points.full()) continue;
                    flush();
                    if (!std::exchange(filled, true)) xs.fill(x);
                }
        }
        flush();
    }
};

} // namespace curlew
