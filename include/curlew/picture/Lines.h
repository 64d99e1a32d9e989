// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"
#include "curlew/picture/Image.h"

#include <span>
#include <vector>

namespace curlew {

/// A line in a picture, in pixels from its upper left corner: the middle of the first pixel is (0.5, 0.5).
struct Segment {
    double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

/// Where an image of one channel has these values: by marching squares between the middles of its pixels, in the order
/// of the rows; second order in the pixels where the values are smooth. Nothing next to a NaN. Throws ValueError for
/// more channels.
std::vector<Segment> isoLines(const Image& scalar, std::span<const double> levels);

/// `count` values that divide the range evenly: neither of its ends, its middle for odd counts.
std::vector<double> evenLevels(double lower, double upper, int count);

/// `count` iso-lines at even levels of the range that most of the image's values have, symmetric about 0
/// (automaticScale). Throws as isoLines does.
std::vector<Segment> contours(const Image& scalar, int count);

/// Arrows of two channels, to the right and up, on a lattice with `across` of them in a row, through the middles of its
/// cells. The longest is 0.9 cells long, or that which is `reference` long; others in proportion. None where a value is
/// NaN, or too small to be seen. Throws ValueError for other channels and across < 1.
std::vector<Segment> arrows(const Image& vectors, int across, double reference = 0);

struct LineStyle {
    Vec3f color{{0.9f, 0.9f, 0.9f}}; ///< Display values.
    float opacity = 1;
    double width = 1.2; ///< Pixels.
};

/// Draws lines with round ends, anti-aliased, on a picture whose first channels are R, G and B. Where they cross, the
/// picture is covered once. What lies outside is not drawn.
void drawLines(Image& picture, const std::vector<Segment>& lines, const LineStyle& style = {});

} // namespace curlew
