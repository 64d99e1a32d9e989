// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Domain.h"
#include "curlew/picture/ColorMap.h"
#include "curlew/picture/Image.h"
#include "curlew/render/Camera.h"
#include "curlew/track/Curves.h"
#include "curlew/track/Points.h"

#include <optional>
#include <span>

namespace curlew {

/// Points, or polylines, and their colours: what a picture is made of. It refers to positions that are elsewhere.
struct Splats {
    std::span<const double> x, y, z;    ///< Positions, world units.
    std::span<const size_t> start = {}; ///< Polyline k has the vertices start[k] … start[k + 1] - 1; empty: points.
    std::vector<uint8_t> closed = {};   ///< Polylines whose last vertex leads to the first; empty: none.
    std::vector<float> values = {};     ///< One for each position, coloured by the scale; empty: all have `color`.
    /// One for each point, 0 to 1: how much of it is seen, as brightness of light or as size of balls; empty: all.
    std::span<const float> fade = {};
    ColorScale scale = {};
    Vec3f color{{1, 1, 1}}; ///< Display values.

    static Splats of(const Points& points);
    static Splats of(const Curves& curves);

    /// Around all positions that are finite. ValueError where there is none.
    Box bounds() const;
};

/// The nearest camera that sees all of the splats, and of the wall's object, if there is one with a box. Strays do not
/// count: what is farther outside of the percentiles 0.5 to 99.5 across the picture, or upwards in it, than half of
/// their distance. The margin is kFramingMargin; without splats, what is seen is the wall's domain. Throws ValueError
/// as Camera::around and Splats::bounds do.
Camera framing(const Splats& splats, const std::optional<Domain>& domain, CameraOptions options);
inline Camera framing(const Splats& splats, CameraOptions options) { return framing(splats, {}, options); }

struct SplatOptions {
    double radius = 0;   ///< World units, in perspective; 0: `pixels` alone.
    double pixels = 1.5; ///< The least radius, pixels. Below it a footprint gets fainter, not smaller.
    double fade = 0.5;   ///< How much weaker the farthest footprints are than the nearest, 0 to 1.
};

/// What is seen, how much of it, and of how many footprints. Points and edges behind the camera are not drawn.
struct SplatImage {
    Image image;
    size_t drawn = 0;   ///< Points, or edges of polylines, whose footprint meets the picture.
    double covered = 0; ///< Part of the picture's pixels.
};

/// The light of luminous points and lines, added up: an image with the channels R, G, B in linear light, in which the
/// middle of one line is 1 (of its colour). A point's footprint is (1 - (d/r)²)², a line's that kernel integrated along
/// it exactly, so that the edges of a polyline join without a seam; with r at least 1.5 pixels the energy of a point or
/// line is the same within 3 % wherever it lies among the pixels. `depth`: one value per pixel, the depth of what hides
/// the splats behind it (empty: nothing does). The sum in each pixel is taken in the order of the input: the same bits
/// for any number of threads. Throws ValueError for colours or sizes that do not fit, ResourceError for more than 2³²
/// positions or too little memory.
SplatImage luminous(const Splats& splats, const Camera& camera, const SplatOptions& options,
                    std::span<const float> depth = {}, const Monitor& monitor = {});

/// Opaque balls and tubes, lit from above the camera's left shoulder: R, G, B (display values, not multiplied by A), A
/// (the part of the pixel that is covered) and Z (the least depth in the pixel, infinite where there is nothing). 16
/// samples a pixel. What is hidden behind `depth` leaves A as it is. Throws as luminous().
SplatImage opaque(const Splats& splats, const Camera& camera, const SplatOptions& options,
                  std::span<const float> depth = {}, const Monitor& monitor = {});

} // namespace curlew
