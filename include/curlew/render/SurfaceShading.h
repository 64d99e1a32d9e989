// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/render/SurfaceView.h"

namespace curlew {

/// How a surface interacts with light.
enum class Finish {
    matt,    ///< Scatters light and hides the background.
    outline, ///< A faint rim where the surface turns away from the camera, added to the background: hides nothing.
    /// Reflects a studio with a window, added to the background: hides nothing. The surface's colours are its
    /// reflectance. For films.
    mirror,
};

/// The look of a surface. Colours are sRGB display values.
struct SurfaceLook {
    Vec3f background{{0.11f, 0.115f, 0.125f}}; ///< In the middle; slightly darker towards the corners.
    Vec3d light{};                             ///< Points to the key light; zero: over the camera's left shoulder.
    double gloss = 0.15;                       ///< Strength of highlight and rim; 0 is dull.
    Finish finish = Finish::matt;
};

/// Shades the surface with a warm key light, as wide as an overcast sun, a cool sky from above and a rim light from
/// behind. `colors` (one for all hits of the view, or one per hit) is the albedo. `shadows`: the surface that casts
/// shadows from the key light. `behind`: a picture made with the same camera, merged with the surface by depth.
///
/// The channels are R, G and B (display values, over the background), A (coverage by this surface and those of
/// `behind`) and Z (depth of the nearest surface along Camera::forward(), world units; infinite if there is none).
/// Light is averaged over the samples of a pixel. Throws ValueError if the number of colours is neither of the two, or
/// if `behind` has a different size or other channels; Interrupted.
Image shadeSurface(const SurfaceView& view, const std::vector<Vec3f>& colors, const SurfaceLook& look,
                   const Surface* shadows = nullptr, const Image* behind = nullptr, const Monitor& monitor = {});

/// Returns the background, as a picture of shadeSurface() in which there is no surface.
Image backgroundPicture(const Camera& camera, const SurfaceLook& look, const Monitor& monitor = {});

/// Shades the surface in the rows of the view, merged with what is in this picture of shadeSurface(). Changes no other
/// rows. Throws likewise.
void shadeOnto(Image& picture, const SurfaceView& view, const std::vector<Vec3f>& colors, const SurfaceLook& look,
               const Surface* shadows = nullptr, const Monitor& monitor = {});

} // namespace curlew
