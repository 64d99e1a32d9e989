// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"
#include "curlew/picture/Image.h"

#include <string>
#include <string_view>

/// What legends and labels are drawn with, on pictures whose first three channels are R, G and B.
namespace curlew::draw {

inline constexpr Vec3f kPaper{{0.06f, 0.06f, 0.06f}}, kInk{{0.88f, 0.88f, 0.88f}}, kFrame{{0.45f, 0.45f, 0.45f}};

/// Of a character of the font, in pixels at scale 1; seven rows down to the base line, two below it.
inline constexpr int kGlyphWidth = 5, kGlyphHeight = 9, kAdvance = 6;

struct Rectangle {
    int x = 0, y = 0, width = 0, height = 0;
};

/// Fills the part of the rectangle that lies in the picture.
void fill(Image& picture, const Rectangle& area, const Vec3f& color);

/// Of a line of text at scale 1.
int textWidth(std::string_view text);

/// The text, cut so that at most `width` pixels are needed at scale 1.
std::string fitted(std::string_view text, int width);

/// In ink, each pixel of the font a square of `scale` pixels.
void drawText(Image& picture, std::string_view text, int left, int top, int scale);

/// Puts an RGB picture into another one, in which it has to have room.
void paste(const Image& part, int left, int top, Image& picture);

} // namespace curlew::draw
