#include "curlew/image/Legend.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>

namespace curlew {

namespace {

constexpr int kGlyphWidth = 5, kGlyphHeight = 9, kAdvance = 6, kGlyphsPerRow = 13;

/// A space follows every glyph of kGlyphRows. The last character stands for all that are not here.
constexpr std::string_view kGlyphNames =
    "0123456789.-+"
    "abcdefghijklm"
    "nopqrstuvwxyz"
    ",:*/=()_%^ \x7f";

/// Rows of thirteen glyphs; seven lines down to the base line, two below it.
constexpr std::array<std::string_view, 4 * kGlyphHeight> kGlyphRows{
    " ###    #    ###   ###     #  #####   ##  #####  ###   ###                    ",
    "#   #  ##   #   # #   #   ##  #      #        # #   # #   #                   ",
    "#  ##   #       #     #  # #  ####  #        #  #   # #   #               #   ",
    "# # #   #     ##    ##  #  #      # ####     #   ###   ####       #####   #   ",
    "##  #   #    #        # #####     # #   #   #   #   #     #             ##### ",
    "#   #   #   #     #   #    #  #   # #   #   #   #   #    #   ##           #   ",
    " ###   ###  #####  ###     #   ###   ###    #    ###   ##    ##           #   ",
    "                                                                              ",
    "                                                                              ",
    "      #               #         ##        #       #      #  #      ##         ",
    "      #               #        #          #                 #       #         ",
    " ###  ####   ###   ####  ###  ####   #### # ##   ##     ##  #  #    #   ## #  ",
    "    # #   # #   # #   # #   #  #    #   # ##  #   #      #  # #     #   # # # ",
    " #### #   # #     #   # #####  #    #   # #   #   #      #  ##      #   # # # ",
    "#   # #   # #   # #   # #      #    #   # #   #   #      #  # #     #   # # # ",
    " #### ####   ###   ####  ###   #     #### #   #  ###     #  #  #   ###  # # # ",
    "                                        #             #  #                    ",
    "                                     ###               ##                     ",
    "                                     #                                        ",
    "                                     #                                        ",
    "# ##   ###  ####   #### # ##   #### ####  #   # #   # #   # #   # #   # ##### ",
    "##  # #   # #   # #   # ##  # #      #    #   # #   # # # #  # #  #   #    #  ",
    "#   # #   # #   # #   # #      ###   #    #   # #   # # # #   #   #   #   #   ",
    "#   # #   # #   # #   # #         #  #    #  ##  # #  # # #  # #  #   #  #    ",
    "#   #  ###  ####   #### #     ####    ##   ## #   #    # #  #   #  #### ##### ",
    "            #         #                                               #       ",
    "            #         #                                            ###        ",
    "                      #          #   #          ##      #         #####       ",
    "              #       #         #     #         ##  #  # #        #   #       ",
    "       ##   # # #    #  #####  #       #           #  #   #       #   #       ",
    "       ##    ###    #          #       #          #               #   #       ",
    "            # # #  #    #####  #       #         #                #   #       ",
    " ##    ##     #   #             #     #         #  ##             #   #       ",
    " ##    ##         #              #   #    #####    ##             #####       ",
    "  #                                                                           ",
    " #                                                                            ",
};

constexpr Vec3f kBackground{{0.06f, 0.06f, 0.06f}}, kInk{{0.88f, 0.88f, 0.88f}}, kFrame{{0.45f, 0.45f, 0.45f}};

/// The strip, in multiples of its scale: the line of the title, then that of the bar between its numbers.
constexpr int kStripHeight = 28, kMargin = 5, kTitleTop = 4, kBarTop = 17, kBarHeight = 7;

/// Room for two of the longest numbers (-1.23e-38) and a bar of 30, whatever the numbers are: so that all frames of a
/// sequence are of one size.
constexpr int kLeastWidth = 156;

struct Rectangle {
    int x, y, width, height;
};

/// Fills the part of the rectangle that lies in the picture.
void fill(Image& picture, const Rectangle& area, const Vec3f& color) {
    for (int y = std::max(area.y, 0); y < std::min(area.y + area.height, picture.height); ++y)
        for (int x = std::max(area.x, 0); x < std::min(area.x + area.width, picture.width); ++x)
            for (int channel = 0; channel < 3; ++channel) picture.at(x, y, channel) = color[channel];
}

bool inked(char character, int x, int y) {
    const char small = character >= 'A' && character <= 'Z' ? static_cast<char>(character - 'A' + 'a') : character;
    const size_t glyph = std::min(kGlyphNames.find(small), kGlyphNames.size() - 1);
    const size_t row = glyph / kGlyphsPerRow * kGlyphHeight + static_cast<size_t>(y);
    return kGlyphRows[row][glyph % kGlyphsPerRow * kAdvance + static_cast<size_t>(x)] == '#';
}

int textWidth(std::string_view text) { return static_cast<int>(text.size()) * kAdvance - 1; }

void drawText(Image& picture, std::string_view text, int left, int top, int scale) {
    for (const char character : text) {
        for (int y = 0; y < kGlyphHeight; ++y)
            for (int x = 0; x < kGlyphWidth; ++x)
                if (inked(character, x, y)) fill(picture, {left + x * scale, top + y * scale, scale, scale}, kInk);
        left += kAdvance * scale;
    }
}

/// The text, cut so that at most `width` pixels are needed at scale 1.
std::string fitted(std::string_view text, int width) {
    const size_t room = static_cast<size_t>(std::max((width + 1) / kAdvance, 0));
    if (text.size() <= room) return std::string(text);
    return std::string(text.substr(0, room - std::min<size_t>(room, 2))) + "..";
}

void drawBar(Image& picture, const Rectangle& area, ColorMap map) {
    fill(picture, {area.x - 1, area.y - 1, area.width + 2, area.height + 2}, kFrame);
    for (int x = 0; x < area.width; ++x) {
        const float t = static_cast<float>(x) / static_cast<float>(std::max(area.width - 1, 1));
        fill(picture, {area.x + x, area.y, 1, area.height}, colorAt(map, t));
    }
}

/// -0 would show its sign.
std::string number(float value) { return fmt::format("{:.3g}", value + 0.0f); }

} // namespace

Image withLegend(const Image& scalar, const ColorScale& scale, std::string_view title) {
    const Image colored = colorize(scalar, scale);
    const std::string lower = number(scale.lower), upper = number(scale.upper);

    const int size = colored.width < 2 * kLeastWidth ? 1 : std::max(2, colored.width / 512);

    Image picture =
        filledImage(std::max(colored.width, kLeastWidth), colored.height + kStripHeight * size, {"R", "G", "B"});
    fill(picture, {0, 0, picture.width, picture.height}, kBackground);
    const int left = (picture.width - colored.width) / 2;
    const auto rowLength = static_cast<ptrdiff_t>(3) * colored.width;
    for (int y = 0; y < colored.height; ++y)
        std::copy_n(colored.pixels.begin() + y * rowLength, rowLength, &picture.at(left, y));

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
