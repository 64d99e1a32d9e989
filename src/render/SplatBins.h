// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "ProjectedSplats.h"

#include <algorithm>
#include <array>

namespace curlew::detail {

/// A rectangle of pixels that is drawn at once, and the splats that it may show.
struct SplatTile {
    int left = 0, top = 0, width = 0, height = 0;
    std::span<const uint32_t> splats; ///< Points, or first vertices of edges; in input order.
};

/// Splats projected by a camera and sorted into the tiles of the picture.
class SplatBins {
  public:
    static constexpr int kTile = 64;

    SplatBins(const Splats& splats, const Camera& camera, const SplatOptions& options, const Monitor& monitor);

    bool lines() const { return mLines; }
    const SplatVertex& vertex(size_t k) const { return mProjected.vertex(k); }
    /// Loads a vertex into the caches.
    void prefetch(size_t k) const { __builtin_prefetch(&mProjected.vertex(k)); }
    /// Projected radius, pixels; may be below the minimum radius.
    float radius(float depth) const { return mRadius > 0 ? mRadius * mProjected.focal() / depth : mPixels; }
    float leastRadius() const { return mPixels; }
    float pixelsPerUnit(float depth) const { return mProjected.focal() / depth; }
    /// Returns the brightness factor of a splat at that depth due to haze.
    float haze(float depth) const {
        return mFar > mNear ? 1 - mFade * std::clamp((depth - mNear) / (mFar - mNear), 0.0f, 1.0f) : 1;
    }
    /// Returns the brightness factor from Splats::fade.
    float fade(size_t k) const { return mVisible.empty() ? 1 : mVisible[k]; }
    /// Returns the colour of a value in linear light.
    const Vec3f& color(float value) const {
        const float t = std::clamp(value, 0.0f, 1.0f) * static_cast<float>(mColors.size() - 1) + 0.5f;
        return mColors[static_cast<size_t>(t)];
    }

    size_t tiles() const { return mFirst.size() - 1; }
    SplatTile tile(size_t k) const;
    size_t drawn() const { return mDrawn; }

  private:
    void sort(const Monitor& monitor);
    /// Returns the tiles that a splat's footprint may overlap, as left, top, right, bottom; if there are none, right <
    /// left.
    std::array<int, 4> tilesOf(size_t k) const;

    int mWidth, mHeight, mColumns, mRows;
    bool mLines;
    float mRadius, mPixels, mFade;
    float mNear = 0, mFar = 0;
    ProjectedSplats mProjected;
    std::vector<uint32_t> mSplats;
    std::vector<size_t> mFirst; ///< First index in mSplats, by tile.
    size_t mDrawn = 0;
    std::vector<Vec3f> mColors;
    std::span<const float> mVisible; ///< Splats::fade.
};

} // namespace curlew::detail
