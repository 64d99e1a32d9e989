// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "SplatBins.h"
#include "curlew/math/Arithmetic.h"

#include <vector>

namespace curlew::detail {

/// A short edge, or a point, in pixels. Depth and light are linear along it.
struct LightStroke {
    float x, y;           ///< Of its beginning.
    float length, ux, uy; ///< From there to its end.
    float radius;
    float depth, recedes;         ///< At its beginning, and the change per pixel.
    Vec3f light, change;          ///< R, G, B likewise.
    int left, top, right, bottom; ///< The pixels that it may light, from the tile's corner.
};

/// The light of a tile's pixels, and the depths that hide it. The pixels of rows 0 and 1 alternate, then those of rows
/// 2 and 3, and so on: strokes are short and narrow, so a square of pixels holds more of one than a part of a row.
struct LitTile {
    static constexpr size_t kLine = SplatBins::kTile + 16; ///< Columns, with room for lanes.
    using Pixels = std::array<float, kLine * SplatBins::kTile>;

    static size_t pixel(int x, int y) {
        return static_cast<size_t>(y / 2) * 2 * kLine + 2 * static_cast<size_t>(x) + static_cast<size_t>(y % 2);
    }

    int left, top;
    bool hides; ///< Whether there are depths.
    std::array<Pixels, 3> light;
    Pixels depth;
};

/// Returns ∫ (k - s²)² ds for s from 0 to t.
template <class T>
T kernelIntegral(const T& k, const T& t) {
    const T tt = t * t;
    return t * (k * k - tt * T(2.0F / 3) * k + tt * tt * T(0.2F));
}

/// Returns the light at an offset from the beginning of a stroke of unit direction (ux, uy), in pixels: 1 in the middle
/// of an infinite line or of a point. Not positive where there is none.
template <class T>
T lightAt(bool line, float length, float ux, float uy, float radius, const T& dx, const T& dy) {
    const T r(1 / radius);
    if (!line) {
        const T k = max(T(1) - (dx * dx + dy * dy) * r * r, T(0));
        return k * k;
    }
    const T along = dx * T(ux) + dy * T(uy), across = dx * T(uy) - dy * T(ux);
    const T k = T(1) - across * across * r * r, half = sqrt(max(k, T(0)));
    const T from = max(-along * r, -half), to = min((T(length) - along) * r, half);
    const T light = (kernelIntegral(k, to) - kernelIntegral(k, from)) * T(15.0F / 16);
    return select((k > T(0)) & (to > from), light, T(0));
}

/// Adds the light of strokes to the pixels of a tile; lanes are the pixels of two rows, in the order of LitTile.
struct LightKernel {
    template <class T>
    static void run(const std::vector<LightStroke>& strokes, const bool& lines, LitTile& tile) {
        alignas(64) constexpr std::array<float, 16> kColumns{0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7};
        alignas(64) constexpr std::array<float, 16> kRows{0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1};
        constexpr int kHigh = kLanes < T >> 1 ? 2 : 1, kWide = kLanes<T> / kHigh;
        const T across = load<T>(kColumns.data()), down = load<T>(kRows.data());
        const auto number = [](int value) { return T(static_cast<float>(value)); };
        for (const LightStroke& s : strokes)
            for (int y = s.top - s.top % kHigh; y < s.bottom; y += kHigh) {
                const T row = number(y) + down, dy = number(tile.top) + row + T(0.5F) - T(s.y);
                const auto inRows = (row < number(s.bottom)) & !(row < number(s.top));
                for (int x = s.left; x < s.right; x += kWide) {
                    const T column = number(x) + across, dx = number(tile.left) + column + T(0.5F) - T(s.x);
                    const T light = lightAt(lines, s.length, s.ux, s.uy, s.radius, dx, dy);
                    const size_t pixel = LitTile::pixel(x, y);
                    auto lit = (light > T(0)) & inRows & (column < number(s.right));
                    const T along = min(max(dx * T(s.ux) + dy * T(s.uy), T(0)), T(s.length));
                    if (tile.hides) lit = lit & !(load<T>(&tile.depth[pixel]) < T(s.depth) + along * T(s.recedes));
                    const T share = select(lit, light, T(0));
                    for (int i = 0; i < 3; ++i) {
                        float* to = &tile.light[static_cast<size_t>(i)][pixel];
                        store(load<T>(to) + share * (T(s.light[i]) + along * T(s.change[i])), to);
                    }
                }
            }
    }
};

} // namespace curlew::detail
