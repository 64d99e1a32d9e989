// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/render/SurfaceView.h"

namespace curlew {

/// What a surface does with light.
enum class Finish {
    matt,    ///< It scatters it, and hides what is behind it.
    outline, ///< Only a faint rim where it turns away from the camera, added to what is behind it: hides nothing.
    mirror,  ///< It reflects it, and hides nothing: its colours are the reflected part of a studio with a window. For
             ///< films.
};

/// How a surface looks. Colours are sRGB display values.
struct SurfaceLook {
    Vec3f background{{0.11f, 0.115f, 0.125f}}; ///< In the middle; a little darker towards the corners.
    Vec3d light{};                             ///< Points to the key light; zero: over the camera's left shoulder.
    double gloss = 0.15;                       ///< Of the highlight and the rim; 0 is dull.
    Finish finish = Finish::matt;
};

/// The surface by a warm key light, which is as wide as an overcast sun, a cool sky from above and a rim from behind,
/// with `colors` (one for all hits of the view, or one for each) as its albedo. `shadows`: whatever throws shadows by
/// the key light. `behind`: a picture made with the same camera that goes behind the surface and before it, by depth.
///
/// Channels R, G and B (display values, the background behind them), A (coverage by this surface and those of `behind`)
/// and Z (depth of the nearest along Camera::forward(), world units; infinite where there is none). Light is averaged
/// over the samples of a pixel. Throws ValueError where the number of colours fits neither, and for a `behind` of
/// another size or other channels; Interrupted.
Image shadeSurface(const SurfaceView& view, const std::vector<Vec3f>& colors, const SurfaceLook& look,
                   const Surface* shadows = nullptr, const Image* behind = nullptr, const Monitor& monitor = {});

} // namespace curlew
