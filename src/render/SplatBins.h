// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "ProjectedSplats.h"
#include "curlew/math/Arithmetic.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace curlew::detail {

/// A rectangle of pixels that is drawn at once, and the splats that it may show.
struct SplatTile {
    int left = 0, top = 0, width = 0, height = 0;
    std::span<const uint32_t> splats; ///< Points, or first vertices of edges; in input order.
};

/// How splats are drawn.
struct SplatLook {
    bool lines = false;
    float radius = 0;                       ///< World units; 0: only `pixels` counts.
    float pixels = 0;                       ///< Minimum radius, pixels.
    float focal = 0;                        ///< Pixels per world unit, times the depth.
    float fade = 0, near = 0, perDepth = 0; ///< Haze: how much, from which depth on, and its growth with depth.
    const Row<float>* colors = nullptr;     ///< Linear R, G, B by value, 0 … lastColor.
    uint32_t lastColor = 0;

    /// Projected radius, pixels; may be below the minimum radius.
    template <class T>
    T radiusAt(const T& depth) const {
        return radius > 0 ? T(radius * focal) / depth : T(pixels);
    }
};

/// Splats projected by a camera and sorted into the tiles of the picture.
class SplatBins {
  public:
    static constexpr int kTile = 64;

    SplatBins(const Splats& splats, const Camera& camera, const SplatOptions& options, const Monitor& monitor);

    const SplatLook& look() const { return mLook; }
    bool lines() const { return mLook.lines; }
    const SplatVertex& vertex(size_t k) const { return mProjected.vertex(k); }
    /// Loads a vertex into the caches.
    void prefetch(size_t k) const { __builtin_prefetch(&mProjected.vertex(k)); }
    /// Radius that is drawn, pixels.
    float drawnRadius(float depth) const { return std::max(mLook.radiusAt(depth), mLook.pixels); }
    float pixelsPerUnit(float depth) const { return mLook.focal / depth; }
    /// Returns the brightness factor of a splat at that depth due to haze.
    float haze(float depth) const {
        return 1 - mLook.fade * std::clamp((depth - mLook.near) * mLook.perDepth, 0.0f, 1.0f);
    }
    /// Returns in how many parts, of the same depth ratio, an edge between two depths looks the same if each has one
    /// projected radius.
    int evenParts(float near, float far) const {
        constexpr float kRatio = 1.1f;
        if (!(mLook.radius > 0 && far > kRatio * near)) return 1;
        return static_cast<int>(std::ceil(std::log(far / near) / std::log(kRatio)));
    }
    /// Returns the brightness factor from Splats::fade.
    float fade(size_t k) const { return mVisible.empty() ? 1 : mVisible[k]; }
    /// Returns the colour of a value in linear light.
    Vec3f color(float value) const {
        const Row<float>& row = mColors[colorIndex(value)];
        return {{row.c[0], row.c[1], row.c[2]}};
    }

    /// Returns a bound of the difference between the colours of the values from a to b and those on a straight line
    /// from the colour of a to that of b, in linear light: a quarter of the distance times the change of the slope.
    float colorError(float a, float b) const { return 0.25f * std::abs((b - a) * (slopesBefore(b) - slopesBefore(a))); }

    size_t tiles() const { return mFirst.size() - 1; }
    SplatTile tile(size_t k) const;
    size_t drawn() const { return mDrawn; }

  private:
    static float unit(float value) { return std::clamp(value, 0.0f, 1.0f); }
    size_t colorIndex(float value) const {
        const float rounded = unit(value) * static_cast<float>(mLook.lastColor) + 0.5f;
        return static_cast<size_t>(rounded);
    }
    /// Returns the sum of the changes of the colours' slope from below the scale to a value.
    float slopesBefore(float value) const {
        if (!(value > 0)) return 0;
        return value < 1 ? mSlopes[colorIndex(value)] : mSlopes.back();
    }
    void sort(const Monitor& monitor);
    /// Returns the tiles that the footprint of a splat in the picture may overlap, as left, top, right, bottom.
    std::array<int, 4> tilesOf(size_t k) const;

    int mWidth, mHeight, mColumns, mRows;
    ProjectedSplats mProjected;
    SplatLook mLook;
    std::vector<uint32_t> mSplats;
    std::vector<size_t> mFirst; ///< First index in mSplats, by tile.
    size_t mDrawn = 0;
    std::vector<Row<float>> mColors;
    std::vector<float> mSlopes;      ///< Sum of the changes of the colours' slope by value, from 0 to each colour.
    std::span<const float> mVisible; ///< Splats::fade.
};

} // namespace curlew::detail
