// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/render/Splat.h"

#include <array>

namespace curlew::detail {

/// A position as the camera sees it: pixels, world units along its view, and a value.
struct SplatVertex {
    float x = 0, y = 0, depth = 0, value = 0;
};

/// A rectangle of pixels that is drawn at once, and what may be seen in it.
struct SplatTile {
    int left = 0, top = 0, width = 0, height = 0;
    std::span<const uint32_t> splats; ///< Points, or the first vertices of edges; in the order of the input.
};

/// Splats as a camera sees them, sorted into the tiles of the picture.
class SplatBins {
  public:
    static constexpr int kTile = 64;

    SplatBins(const Splats& splats, const Camera& camera, const SplatOptions& options, const Monitor& monitor);

    bool lines() const { return mLines; }
    const SplatVertex& vertex(size_t k) const { return mVertices[k]; }
    /// In pixels: as it is seen, which may be less than the least one.
    float radius(float depth) const { return mRadius > 0 ? mRadius * mFocal / depth : mPixels; }
    float leastRadius() const { return mPixels; }
    float pixelsPerUnit(float depth) const { return mFocal / depth; }
    /// How much of a splat at that depth is left in the haze.
    float haze(float depth) const;
    /// How much of a splat is seen otherwise.
    float fade(size_t k) const { return mSeen.empty() ? 1 : mSeen[k]; }
    /// In linear light.
    const Vec3f& color(float value) const;

    size_t tiles() const { return mFirst.size() - 1; }
    SplatTile tile(size_t k) const;
    size_t drawn() const { return mDrawn; }

  private:
    void project(const Splats& splats, const Camera& camera, const Monitor& monitor);
    void sort(const Monitor& monitor);
    /// The tiles that a splat's footprint may meet, as left, top, right, bottom; none: right below left.
    std::array<int, 4> tilesOf(size_t k) const;

    int mWidth, mHeight, mColumns, mRows;
    bool mLines;
    float mRadius, mPixels, mFocal, mFade;
    float mNear = 0, mFar = 0;
    std::vector<SplatVertex> mVertices; ///< A closed polyline has its first vertex at its end once more.
    std::vector<uint8_t> mShown;        ///< Whether a point, or an edge that begins here, is before the camera.
    std::vector<uint32_t> mSplats;
    std::vector<size_t> mFirst; ///< In mSplats, by tile.
    size_t mDrawn = 0;
    std::vector<Vec3f> mColors;
    std::span<const float> mSeen; ///< Splats::fade.
};

} // namespace curlew::detail
