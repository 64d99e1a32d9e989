// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/base/Random.h"
#include "curlew/flow/Domain.h"
#include "curlew/picture/ColorMap.h"
#include "curlew/picture/Image.h"
#include "curlew/render/Camera.h"
#include "curlew/track/Curves.h"
#include "curlew/track/Points.h"

#include <algorithm>
#include <optional>
#include <span>

namespace curlew {

/// Points or polylines to draw, and their colours. Refers to positions that are stored elsewhere.
struct Splats {
    std::span<const double> x, y, z;    ///< Positions, world units.
    std::span<const size_t> start = {}; ///< Polyline k has the vertices start[k] … start[k + 1] - 1; empty: points.
    /// One flag per polyline: 1 if its last vertex connects to its first; empty: all are open.
    std::vector<uint8_t> closed = {};
    std::vector<float> values = {}; ///< One per position, coloured by the scale; empty: all have `color`.
    /// One per point, 0 to 1: visibility, as brightness of light or size of balls; empty: all are fully visible.
    std::span<const float> fade = {};
    ColorScale scale = {};
    Vec3f color{{1, 1, 1}}; ///< Display values.

    static Splats of(const Points& points);
    static Splats of(const Curves& curves);

    /// Returns the box around all finite positions. Throws ValueError if there is none.
    Box bounds() const;
};

/// About how many positions decide on the camera and on the range of the colours.
inline constexpr size_t kEnoughSplats = 500'000;

/// Calls visit(k) for all indices below `count`, or for kEnoughSplats of them at most: one out of each of as many equal
/// parts, pseudo-random, so that they do not always meet the same vertex of curves of equal lengths.
template <class Visit>
void forEnough(size_t count, const Visit& visit) {
    const size_t every = (count + kEnoughSplats - 1) / kEnoughSplats;
    for (size_t k = 0; k < count; k += every) {
        const auto within = static_cast<size_t>(randomUniform(0, k) * static_cast<double>(every));
        visit(std::min(k + within, count - 1));
    }
}

/// Returns the nearest camera that sees all splats, and the wall's object if there is one with a finite box. Ignores
/// outliers: splats that lie outside the percentiles 0.5 to 99.5, horizontally or vertically in the picture, by more
/// than half of that range; of fewer than 200, none. Of many positions, only kEnoughSplats are looked at, spread evenly
/// over the list. The margin is kFramingMargin. If there are neither splats nor such an object, the camera shows the
/// domain's box. Throws ValueError like Camera::around and Splats::bounds.
Camera framing(const Splats& splats, const std::optional<Domain>& domain, CameraOptions options);
inline Camera framing(const Splats& splats, CameraOptions options) { return framing(splats, {}, options); }

struct SplatOptions {
    double radius = 0;   ///< World units, in perspective; 0: only `pixels` counts.
    double pixels = 1.5; ///< Minimum radius, pixels. Smaller footprints become fainter, not smaller.
    double fade = 0.5;   ///< Attenuation of the farthest footprints relative to the nearest, 0 to 1.
};

/// The picture and its statistics. Points and parts of edges behind the camera are not drawn.
struct SplatImage {
    Image image;
    size_t drawn = 0;   ///< Points or polyline edges whose footprint overlaps the picture.
    double covered = 0; ///< Covered fraction of the picture's pixels.
};

/// Adds up the light of luminous points and lines: an image with the channels R, G, B in linear light, where the middle
/// of one line is 1 (times its colour). The footprint of a point is (1 - (d/r)²)². That of a line is this kernel,
/// integrated exactly along the line, so that the edges of a polyline join without a seam. Depths and values change
/// evenly along an edge in space. Edges in a row are drawn as one of at most 6 pixels if that is right to 1/16 pixel
/// and 1/256 of the colour scale. If r is at least 1.5 pixels, the energy of a point or line is the same within 3 % for
/// any position relative to the pixels. `depth`: one value per pixel, the depth of the surface that hides splats behind
/// it (empty: nothing is hidden). Each pixel sums its splats in input order, so the bits are the same for any number of
/// threads. Throws ValueError if colours or sizes do not fit, ResourceError if there are more than 2³² positions or too
/// little memory.
SplatImage luminous(const Splats& splats, const Camera& camera, const SplatOptions& options,
                    std::span<const float> depth = {}, const Monitor& monitor = {});

/// Draws opaque balls and tubes, with short edges as above, lit from above the camera's left shoulder: R, G, B (display
/// values, not premultiplied by A), A (coverage of the pixel) and Z (minimum depth in the pixel; infinite if there is
/// none). 16 samples per pixel. Parts hidden behind `depth` do not change A. Throws like luminous().
SplatImage opaque(const Splats& splats, const Camera& camera, const SplatOptions& options,
                  std::span<const float> depth = {}, const Monitor& monitor = {});

} // namespace curlew
