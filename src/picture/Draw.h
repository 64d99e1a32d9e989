// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"
#include "curlew/picture/Image.h"

#include <string>
#include <string_view>

/// Drawing of legends and labels on pictures whose first three channels are R, G and B.
namespace curlew::draw {

inline constexpr Vec3f kPaper{{0.06f, 0.06f, 0.06f}}, kInk{{0.88f, 0.88f, 0.88f}}, kFrame{{0.45f, 0.45f, 0.45f}};

/// Size of a character of the font in pixels at scale 1; seven rows above the baseline, two below it.
inline constexpr int kGlyphWidth = 5, kGlyphHeight = 9, kAdvance = 6;

struct Rectangle {
    int x = 0, y = 0, width = 0, height = 0;
};

/// Fills the part of the rectangle that lies in the picture.
void fill(Image& picture, const Rectangle& area, const Vec3f& color);

/// Returns the width of a line of text at scale 1.
int textWidth(std::string_view text);

/// Returns the text, cut so that it needs at most `width` pixels at scale 1.
std::string fitted(std::string_view text, int width);

/// Draws text in the ink colour; each pixel of the font becomes a square of `scale` pixels.
void drawText(Image& picture, std::string_view text, int left, int top, int scale);

/// Copies an RGB picture into another one, in which it must fit.
void paste(const Image& part, int left, int top, Image& picture);

} // namespace curlew::draw
