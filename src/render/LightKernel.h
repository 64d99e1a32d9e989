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

/// The light of a tile's pixels, and the depths that hide it.
struct LitTile {
    static constexpr size_t kLine = SplatBins::kTile + 16; ///< Pixels from one row to the next, with room for lanes.
    using Pixels = std::array<float, kLine * SplatBins::kTile>;

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

/// Adds the light of strokes to the pixels of a tile; lanes are the pixels of a row.
struct LightKernel {
    template <class T>
    static void run(const std::vector<LightStroke>& strokes, const bool& lines, LitTile& tile) {
        alignas(64) constexpr std::array<float, 16> kOffsets{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
        const T offset = load<T>(kOffsets.data());
        for (const LightStroke& s : strokes)
            for (int y = s.top; y < s.bottom; ++y) {
                const T dy(static_cast<float>(tile.top + y) + 0.5F - s.y);
                for (int x = s.left; x < s.right; x += kLanes<T>) {
                    const T column = T(static_cast<float>(tile.left + x)) + offset;
                    const T dx = column + T(0.5F) - T(s.x);
                    const T light = lightAt(lines, s.length, s.ux, s.uy, s.radius, dx, dy);
                    const size_t pixel = static_cast<size_t>(y) * LitTile::kLine + static_cast<size_t>(x);
                    auto lit = (light > T(0)) & (offset < T(static_cast<float>(s.right - x)));
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
