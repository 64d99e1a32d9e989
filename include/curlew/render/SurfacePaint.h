// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Flow.h"
#include "curlew/math/Range.h"
#include "curlew/picture/Slice.h"
#include "curlew/render/SurfaceView.h"
#include "curlew/track/Advect.h"

#include <array>
#include <optional>
#include <string_view>

namespace curlew {

/// What is on a surface (SurfaceTexture.h, ThinFilm.h).
enum class Texture {
    none,
    checker,  ///< checkerAt
    waves,    ///< wavesAt
    latitude, ///< latitudeAt, about the middle of the box.
    terrain,  ///< terrainAt, by height in the box.
    film,     ///< What a ThinFilm reflects that gets thicker from the top of the box to its bottom.
    lic       ///< surfaceLic along the flow, times the colour.
};
inline constexpr std::array<std::string_view, 7> kTextureNames{"none",    "checker", "waves", "latitude",
                                                               "terrain", "film",    "lic"};

struct SurfacePaint {
    Texture texture = Texture::none;
    Vec3f color{{0.74f, 0.70f, 0.65f}};  ///< sRGB display values; also one of the two of a checker.
    Vec3f second{{0.16f, 0.20f, 0.26f}}; ///< The other one.
    double edge = 0.1;                   ///< Of a checker's cubes, or the width of the waves, world units.
    Range film{80, 900};                 ///< Thickness of the film at its top and bottom, nm.
    Box box = {};                        ///< Of the surface.
    uint64_t seed = 0;                   ///< Of the noise of `lic`.
    /// A source of one channel that colours the surface instead of `color` and of any texture but `lic`.
    std::optional<SliceSource> source = {};
    /// The flow of `lic`, and the one that carries the texture or the source along.
    std::optional<Flow> flow = {};
    /// From each hit to where its colour is looked up: a texture that the flow has carried for t seconds has the time
    /// -t (ICN §5.3). Nothing moves if the time is 0.
    AdvectOptions carry{.time = 0};
};

struct PaintedColors {
    std::vector<Vec3f> colors;                ///< One for each hit of the view, or one for all.
    std::optional<AdvectResult> carried = {}; ///< Of the hits, if they have been moved.
};

/// The colours of what a camera sees of a surface. The same for any number of threads. Throws ValueError if there is no
/// flow and one is needed, and as advect() and surfaceLic() do; Interrupted.
PaintedColors paintedColors(const SurfaceView& view, const SurfacePaint& paint, const Monitor& monitor = {});

} // namespace curlew
