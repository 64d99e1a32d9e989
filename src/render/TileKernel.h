// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "SplatBins.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace curlew::detail {

/// Finds the tile that shows each of some splats.
struct TileKernel {
    static constexpr size_t kMost = 64;
    static constexpr float kNone = -1, kSeveral = -2; ///< Instead of the number of a tile.

    /// Splats whose first vertices follow one another, and the pixels and tiles of the picture. One more vertex is
    /// read.
    struct Job {
        const SplatVertex* vertices;
        size_t count; ///< At most kMost.
        int width, height, columns;
    };
    using Tiles = std::array<float, kMost>;

    template <class T>
    static void run(const Job& job, const SplatLook& look, Tiles& tiles) {
        for (size_t k = 0; k < job.count; k += kLanes<T>) {
            std::array<const float*, size_t{kLanes<T>}> places;
            for (size_t n = 0; n < places.size(); ++n) places[n] = &job.vertices[std::min(k + n, job.count - 1)].x;
            const auto a = fourFrom<T>(places.data(), 0), b = fourFrom<T>(places.data(), look.lines ? 4 : 0);
            const T reach = max(look.radiusAt(min(a[2], b[2])), T(look.pixels));
            const auto side = [&](const T& pixel, int size) { // of the tile, from the left or the top
                const T within = min(max(pixel, T(0)), T(static_cast<float>(size - 1)));
                return floor(within * T(1.0F / static_cast<float>(SplatBins::kTile)));
            };
            const T left = min(a[0], b[0]) - reach, right = max(a[0], b[0]) + reach;
            const T top = min(a[1], b[1]) - reach, bottom = max(a[1], b[1]) + reach;
            const auto seen = (right >= T(0)) & (left < T(static_cast<float>(job.width))) & (bottom >= T(0)) &
                              (top < T(static_cast<float>(job.height))); // not if NaN
            const T column = side(left, job.width), row = side(top, job.height);
            const auto one = (side(right, job.width) == column) & (side(bottom, job.height) == row);
            const T tile = row * T(static_cast<float>(job.columns)) + column;
            store(select(seen, select(one, tile, T(kSeveral)), T(kNone)), &tiles[k]);
        }
    }
};

} // namespace curlew::detail
