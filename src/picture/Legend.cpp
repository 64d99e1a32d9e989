// SPDX-License-Identifier: Apache-2.0
#include "curlew/picture/Legend.h"

#include "Draw.h"
#include "curlew/base/Memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

namespace curlew {

using namespace draw;

namespace {

/// Layout of the strip at scale 1: the title line, then the bar between its numbers.
constexpr int kStripHeight = 28, kMargin = 5, kTitleTop = 4, kBarTop = 17, kBarHeight = 7;

/// Room for two of the longest numbers (-1.23e-38) and a bar of 30 pixels, whatever the numbers are, so that all frames
/// of a sequence have the same size.
constexpr int kMinWidth = 156;

void drawBar(Image& picture, const Rectangle& area, ColorMap map) {
    fill(picture, {area.x - 1, area.y - 1, area.width + 2, area.height + 2}, kFrame);
    for (int x = 0; x < area.width; ++x) {
        const float t = static_cast<float>(x) / static_cast<float>(std::max(area.width - 1, 1));
        fill(picture, {area.x + x, area.y, 1, area.height}, colorAt(map, t));
    }
}

/// Formats a number; adding 0 removes the sign of -0.
std::string number(float value) { return fmt::format("{:.3g}", value + 0.0f); }

} // namespace

Image withLegend(const Image& scalar, const ColorScale& scale, std::string_view title) {
    constexpr double kPictures = 2 * 3 * sizeof(float); // bytes per pixel of the colours and of the result
    requireMemory(kPictures * static_cast<double>(scalar.pixels.size()), "a picture with a legend",
                  "choose a smaller width, or leave out the legend");
    const Image colored = colorize(scalar, scale);
    const std::string lower = number(scale.lower), upper = number(scale.upper);

    const int size = colored.width < 2 * kMinWidth ? 1 : std::max(2, colored.width / 512);

    Image picture =
        filledImage(std::max(colored.width, kMinWidth), colored.height + kStripHeight * size, {"R", "G", "B"});
    fill(picture, {0, 0, picture.width, picture.height}, kPaper);
    paste(colored, (picture.width - colored.width) / 2, 0, picture);

    const auto lineTop = [&](int line) { return colored.height + line * size; };
    const int titleRoom = picture.width - 2 * kMargin * size;
    const int titleSize = textWidth(title) * size <= titleRoom ? size : 1;
    drawText(picture, fitted(title, titleRoom / titleSize), kMargin * size, lineTop(kTitleTop), titleSize);
    drawText(picture, lower, kMargin * size, lineTop(kBarTop), size);
    drawText(picture, upper, picture.width - (kMargin + textWidth(upper)) * size, lineTop(kBarTop), size);
    const int barLeft = (2 * kMargin + textWidth(lower)) * size;
    const int barRight = picture.width - (2 * kMargin + textWidth(upper)) * size;
    drawBar(picture, {barLeft, lineTop(kBarTop), barRight - barLeft, kBarHeight * size}, scale.map);
    return picture;
}

} // namespace curlew
