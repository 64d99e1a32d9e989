// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"
#include "curlew/picture/Image.h"

#include <span>
#include <vector>

namespace curlew {

/// A line segment in a picture, in pixels from its upper left corner: the centre of the first pixel is (0.5, 0.5).
struct Segment {
    double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

/// Returns the iso-lines of an image of one channel at these levels, by marching squares between its pixel centres, in
/// row order; second order in the pixel size where the values are smooth. Cells with a NaN have no lines. Throws
/// ValueError if there is more than one channel.
std::vector<Segment> isoLines(const Image& scalar, std::span<const double> levels);

/// Returns `count` values that divide the range evenly, without its ends; an odd count includes its middle.
std::vector<double> evenLevels(double lower, double upper, int count);

/// Returns `count` iso-lines at even levels of the range that contains most of the image's values, symmetric about 0
/// (automaticScale). Throws like isoLines.
std::vector<Segment> contours(const Image& scalar, int count);

/// Returns arrows for two channels, right and up, at the cell centres of a lattice with `across` cells per row. The
/// longest arrow, or one of length `reference`, is 0.9 cells long; the others are in proportion. Arrows that are NaN or
/// too small to see are dropped. Throws ValueError for other channels, and if across < 1.
std::vector<Segment> arrows(const Image& vectors, int across, double reference = 0);

struct LineStyle {
    Vec3f color{{0.9f, 0.9f, 0.9f}}; ///< Display values.
    float opacity = 1;
    double width = 1.2; ///< Pixels.
};

/// Draws anti-aliased lines with round ends on a picture whose first channels are R, G and B. Where lines cross, the
/// picture is covered only once. Parts outside the picture are not drawn.
void drawLines(Image& picture, const std::vector<Segment>& lines, const LineStyle& style = {});

} // namespace curlew
