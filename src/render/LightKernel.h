// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "SplatBins.h"
#include "curlew/math/Arithmetic.h"

#include <array>

namespace curlew::detail {

/// Short edges, or points, in pixels: a structure of arrays. The ends of a point are the same.
struct LightEdges {
    static constexpr size_t kMost = 64;
    using Numbers = std::array<float, kMost>;
    struct Ends {
        alignas(64) Numbers x, y, depth, value;

        void set(size_t k, const SplatVertex& vertex) {
            x[k] = vertex.x;
            y[k] = vertex.y;
            depth[k] = vertex.depth;
            value[k] = vertex.value;
        }
    };

    size_t size = 0;
    Ends from{}, to{};
    alignas(64) Numbers middle{}; ///< The depth at which the radius is seen.
    alignas(64) Numbers fade{};   ///< Visibility, 0 to 1.

    void push(const SplatVertex& a, const SplatVertex& b, float depth, float visibility) {
        from.set(size, a);
        to.set(size, b);
        middle[size] = depth;
        fade[size++] = visibility;
    }
    bool full() const { return size == kMost; }
};

/// What the pixels need to know of edges. Depth and light are linear along an edge.
struct LightStrokes {
    using Numbers = LightEdges::Numbers;
    alignas(64) Numbers length, ux, uy; ///< To its end.
    alignas(64) Numbers radius;
    alignas(64) Numbers recedes;                  ///< Change of the depth per pixel.
    alignas(64) std::array<Numbers, 3> light;     ///< R, G, B at its beginning.
    alignas(64) std::array<Numbers, 3> change;    ///< Of R, G, B per pixel.
    alignas(64) Numbers left, top, right, bottom; ///< The pixels that it may light, from the tile's corner.
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
    alignas(64) std::array<Pixels, 3> light;
    alignas(64) Pixels depth;
};

/// Returns ∫ (k - s²)² ds for s from 0 to t.
template <class T>
T kernelIntegral(const T& k, const T& t) {
    const T tt = t * t;
    return t * (k * k - tt * T(2.0F / 3) * k + tt * tt * T(0.2F));
}

/// Returns the light at an offset from the beginning of a stroke, along and across it, in pixels: 1 in the middle of an
/// infinite line or of a point. Not positive where there is none.
template <class T>
T lightAt(bool line, const T& length, const T& along, const T& across, const T& radius) {
    const T r = T(1) / radius;
    if (!line) {
        const T k = max(T(1) - (along * along + across * across) * r * r, T(0));
        return k * k;
    }
    const T k = T(1) - across * across * r * r, half = sqrt(max(k, T(0)));
    const T from = max(-along * r, -half), to = min((length - along) * r, half);
    const T light = (kernelIntegral(k, to) - kernelIntegral(k, from)) * T(15.0F / 16);
    return select((k > T(0)) & (to > from), light, T(0));
}

/// Prepares edges.
struct StrokeKernel {
    template <class T>
    static void run(const LightEdges& edges, const SplatLook& look, const SplatTile& tile, LightStrokes& strokes) {
        const T zero(0), one(1);
        for (size_t k = 0; k < edges.size; k += kLanes<T>) {
            const auto get = [k](const LightEdges::Numbers& numbers) { return load<T>(&numbers[k]); };
            const auto set = [k](const T& value, LightEdges::Numbers& numbers) { store(value, &numbers[k]); };
            const auto clamped = [&](const T& x, const T& most) { return min(max(x, zero), most); };
            const T ax = get(edges.from.x), ay = get(edges.from.y), bx = get(edges.to.x), by = get(edges.to.y);
            const T aDepth = get(edges.from.depth), bDepth = get(edges.to.depth);

            const T dx = bx - ax, dy = by - ay, length = sqrt(dx * dx + dy * dy);
            const auto isLine = length > zero;
            const T part = select(isLine, one / length, zero);
            set(length, strokes.length);
            set(select(isLine, dx * part, one), strokes.ux);
            set(dy * part, strokes.uy);
            set((bDepth - aDepth) * part, strokes.recedes);

            // A splat drawn larger than its projected size keeps its energy.
            const T seen = look.radiusAt(get(edges.middle));
            const T radius = max(seen, T(look.pixels)), ratio = seen / radius;
            const T energy = get(edges.fade) * (look.lines ? ratio : ratio * ratio);
            set(radius, strokes.radius);

            const auto lightOf = [&](const T& value, const T& depth) {
                const T color = floor(clamped(value, one) * T(static_cast<float>(look.lastColor)) + T(0.5F));
                std::array<T, 3> light = rowsAt<T, 3>(look.colors, indicesOf(color, look.lastColor));
                const T haze = one - T(look.fade) * clamped((depth - T(look.near)) * T(look.perDepth), one);
                for (T& channel : light) channel *= energy * haze;
                return light;
            };
            const auto begin = lightOf(get(edges.from.value), aDepth), end = lightOf(get(edges.to.value), bDepth);
            for (size_t i = 0; i < 3; ++i) {
                set(begin[i], strokes.light[i]);
                set((end[i] - begin[i]) * part, strokes.change[i]);
            }

            const auto pixels = [&](const T& lower, const T& upper, int origin, int size, auto& first, auto& last) {
                const T o(static_cast<float>(origin)), most(static_cast<float>(size));
                set(floor(clamped(lower - radius - o + T(0.5F), most)), first);
                set(floor(clamped(upper + radius - o + T(0.5F), most)), last);
            };
            pixels(min(ax, bx), max(ax, bx), tile.left, tile.width, strokes.left, strokes.right);
            pixels(min(ay, by), max(ay, by), tile.top, tile.height, strokes.top, strokes.bottom);
        }
    }
};

/// Adds the light of edges to the pixels of a tile; lanes are the pixels of two rows, in the order of LitTile.
struct LightKernel {
    template <class T>
    static void run(const LightEdges& edges, const LightStrokes& strokes, const bool& lines, LitTile& tile) {
        alignas(64) constexpr std::array<float, 16> kColumns{0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7};
        alignas(64) constexpr std::array<float, 16> kRows{0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1};
        constexpr int kHigh = kLanes < T >> 1 ? 2 : 1, kWide = kLanes<T> / kHigh;
        const T across = load<T>(kColumns.data()), down = load<T>(kRows.data());
        const auto number = [](int value) { return T(static_cast<float>(value)); };
        for (size_t k = 0; k < edges.size; ++k) {
            const auto of = [k](const LightEdges::Numbers& numbers) { return T(numbers[k]); };
            const auto pixel = [k](const LightEdges::Numbers& numbers) { return static_cast<int>(numbers[k]); };
            const T x0 = of(edges.from.x), y0 = of(edges.from.y), depth = of(edges.from.depth);
            const T length = of(strokes.length), ux = of(strokes.ux), uy = of(strokes.uy);
            const T radius = of(strokes.radius), recedes = of(strokes.recedes);
            const int left = pixel(strokes.left), right = pixel(strokes.right);
            const int top = pixel(strokes.top), bottom = pixel(strokes.bottom);
            for (int y = top - top % kHigh; y < bottom; y += kHigh) {
                const T row = number(y) + down, dy = number(tile.top) + row + T(0.5F) - y0;
                const auto inRows = (row < number(bottom)) & !(row < number(top));
                for (int x = left; x < right; x += kWide) {
                    const T column = number(x) + across, dx = number(tile.left) + column + T(0.5F) - x0;
                    const T along = dx * ux + dy * uy, light = lightAt(lines, length, along, dx * uy - dy * ux, radius);
                    const size_t at = LitTile::pixel(x, y);
                    auto lit = (light > T(0)) & inRows & (column < number(right));
                    const T within = min(max(along, T(0)), length);
                    if (tile.hides) lit = lit & !(load<T>(&tile.depth[at]) < depth + within * recedes);
                    const T share = select(lit, light, T(0));
                    for (size_t i = 0; i < 3; ++i) {
                        float* to = &tile.light[i][at];
                        store(load<T>(to) + share * (of(strokes.light[i]) + within * of(strokes.change[i])), to);
                    }
                }
            }
        }
    }
};

} // namespace curlew::detail
