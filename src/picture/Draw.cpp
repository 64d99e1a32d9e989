// SPDX-License-Identifier: Apache-2.0
#include "Draw.h"

#include <algorithm>
#include <array>

namespace curlew::draw {

namespace {

constexpr int kGlyphsPerRow = 13;

/// The characters in kGlyphRows, where a blank column follows every glyph. The last one stands for all other
/// characters.
constexpr std::string_view kGlyphNames =
    "0123456789.-+"
    "abcdefghijklm"
    "nopqrstuvwxyz"
    ",:*/=()_%^ \x7f";

/// Rows of thirteen glyphs; seven lines above the baseline, two below it.
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

bool inked(char character, int x, int y) {
    const char small = character >= 'A' && character <= 'Z' ? static_cast<char>(character - 'A' + 'a') : character;
    const size_t glyph = std::min(kGlyphNames.find(small), kGlyphNames.size() - 1);
    const size_t row = glyph / kGlyphsPerRow * kGlyphHeight + static_cast<size_t>(y);
    return kGlyphRows[row][glyph % kGlyphsPerRow * kAdvance + static_cast<size_t>(x)] == '#';
}

} // namespace

void fill(Image& picture, const Rectangle& area, const Vec3f& color) {
    for (int y = std::max(area.y, 0); y < std::min(area.y + area.height, picture.height); ++y)
        for (int x = std::max(area.x, 0); x < std::min(area.x + area.width, picture.width); ++x)
            for (int channel = 0; channel < 3; ++channel) picture.at(x, y, channel) = color[channel];
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

std::string fitted(std::string_view text, int width) {
    const size_t room = static_cast<size_t>(std::max((width + 1) / kAdvance, 0));
    if (text.size() <= room) return std::string(text);
    return std::string(text.substr(0, room - std::min<size_t>(room, 2))) + "..";
}

void paste(const Image& part, int left, int top, Image& picture) {
    const auto row = static_cast<std::ptrdiff_t>(3) * part.width;
    for (int y = 0; y < part.height; ++y) std::copy_n(part.pixels.begin() + y * row, row, &picture.at(left, top + y));
}

} // namespace curlew::draw
