// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Flow.h"
#include "curlew/math/Interval.h"
#include "curlew/picture/ColorMap.h"
#include "curlew/picture/Slice.h"
#include "curlew/render/SurfaceTexture.h"
#include "curlew/track/Advect.h"

#include <array>
#include <optional>
#include <string_view>

namespace curlew {

/// The texture of a surface (SurfaceTexture.h, ThinFilm.h).
enum class Texture {
    none,
    checker,  ///< checkerAt
    waves,    ///< wavesAt
    latitude, ///< latitudeAt, around the centre of the box.
    terrain,  ///< terrainAt, by height in the box; in the middle if the box is flat.
    film,     ///< The reflection of a ThinFilm whose thickness grows from the top of the box to its bottom.
    lic       ///< surfaceLic along the flow, times the colour.
};
inline constexpr std::array<std::string_view, 7> kTextureNames{"none",    "checker", "waves", "latitude",
                                                               "terrain", "film",    "lic"};

/// The values to which a source's colours and the contrast of streaks refer.
struct PaintRange {
    std::optional<ColorScale> source = {};
    std::optional<LicRange> streaks = {};
};

struct SurfacePaint {
    Texture texture = Texture::none;
    Vec3f color{{0.74f, 0.70f, 0.65f}};  ///< sRGB display values; also the first colour of a checker.
    Vec3f second{{0.16f, 0.20f, 0.26f}}; ///< The second colour of a checker.
    double edge = 0.1;                   ///< Edge of a checker's cubes, or width of the waves, world units.
    Interval film{80, 900};              ///< Thickness of the film at its top and bottom, nm.
    Box box = {};                        ///< Box of the surface.
    uint64_t seed = 0;                   ///< Seed of the noise of `lic`.
    /// A source of one channel that colours the surface. Replaces `color` and every texture except `lic`.
    std::optional<SliceSource> source = {};
    /// The flow of `lic`, which also advects the texture or the source.
    std::optional<Flow> flow = {};
    /// Advection from each hit to the position where its colour is looked up: for a texture that the flow has carried
    /// for t seconds, the time is -t (ICN §5.3). 0: no advection.
    AdvectOptions carry{.time = 0};
    /// Default: the values at the hits of the view that is painted.
    std::optional<PaintRange> range = {};
};

struct PaintedColors {
    std::vector<Vec3f> colors;                ///< One per hit of the view, or one for all.
    std::optional<AdvectResult> carried = {}; ///< Result of the hits' advection, if there was any.
};

/// Returns the range of the values at some positions of a surface. `resolution`: SurfaceView::resolution. Throws like
/// paintedColors().
PaintRange paintRange(const std::vector<Vec3d>& positions, double resolution, const SurfacePaint& paint,
                      const Monitor& monitor = {});

/// Returns the colours of the surface that a camera sees. The same for any number of threads. Throws ValueError if a
/// flow is needed but missing, and like advect() and surfaceLic(); Interrupted.
PaintedColors paintedColors(const SurfaceView& view, const SurfacePaint& paint, const Monitor& monitor = {});

} // namespace curlew
