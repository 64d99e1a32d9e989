// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/UninitializedArray.h"
#include "curlew/render/Splat.h"

#include <cstdint>
#include <vector>

namespace curlew::detail {

/// A projected position: pixels, depth in world units, and a value.
struct SplatVertex {
    float x, y, depth, value;
};

/// Returns how many vertices may be stored: a closed polyline repeats its first one at its end, and edges that reach
/// behind the camera are cut, so that a vertex may have another one beside it.
size_t mostVertices(const Splats& splats);

/// Splats as a camera sees them. Consecutive edges of a polyline are one edge if that looks the same.
class ProjectedSplats {
  public:
    static constexpr float kShort = 6; ///< Pixels; the light and depth of a shorter edge may be linear along it.

    /// Vertices that are stored one after the other; those of a polyline are in one run.
    struct Run {
        size_t begin, end;
    };

    ProjectedSplats(const Splats& splats, const Camera& camera, const Monitor& monitor);

    /// Pixels per world unit, times the depth.
    float focal() const { return mFocal; }
    const std::vector<Run>& runs() const { return mRuns; }
    const SplatVertex& vertex(size_t k) const { return mVertices[k]; }
    /// Returns how many points or edges the one stands for that begins at a vertex; 0 if none does, or if it is behind
    /// the camera.
    size_t standsFor(size_t k) const { return mStandsFor[k]; }

  private:
    static constexpr size_t kMostRuns = 64, kShortestRun = 1 << 14;

    void projectPoints(const Splats& splats, const Camera& camera, const Monitor& monitor);
    void projectPolylines(const Splats& splats, const Camera& camera, const Monitor& monitor);

    float mFocal;
    // Only vertices in runs are set, so the others take no memory. There is one more than may be set (TileKernel).
    UninitializedArray<SplatVertex> mVertices;
    UninitializedArray<uint8_t> mStandsFor;
    std::vector<Run> mRuns;
};

} // namespace curlew::detail
