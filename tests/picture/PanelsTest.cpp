// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/picture/Panels.h"
#include "support/Catch.h"

#include <algorithm>

using namespace curlew;

namespace {

Image plain(int width, int height, float value) { return filledImage(width, height, {"R", "G", "B"}, value); }

/// Returns whether all pixels of a rectangle have the value.
bool holds(const Image& image, int left, int top, int width, int height, float value) {
    for (int y = top; y < top + height; ++y)
        for (int x = left; x < left + width; ++x)
            for (int channel = 0; channel < 3; ++channel)
                if (image.at(x, y, channel) != value) return false;
    return true;
}

/// Returns the number of pixels with the brightness of the letters.
int64_t ink(const Image& image) {
    return std::count_if(image.pixels.begin(), image.pixels.end(), [](float v) { return v > 0.85f && v < 0.9f; }) / 3;
}

} // namespace

TEST_CASE("panels: are laid out in rows with gaps between and around them", "[picture]") {
    const Image sheet =
        panels({plain(20, 10, 0.2f), plain(20, 10, 0.3f), plain(20, 10, 0.4f)}, {.columns = 2, .gap = 3});
    REQUIRE((sheet.width == 3 + 20 + 3 + 20 + 3 && sheet.height == 3 + 10 + 3 + 10 + 3));
    REQUIRE_NOTHROW(checkImage(sheet));
    CHECK(holds(sheet, 3, 3, 20, 10, 0.2f));
    CHECK(holds(sheet, 26, 3, 20, 10, 0.3f));
    CHECK(holds(sheet, 3, 16, 20, 10, 0.4f));
    const float ground = sheet.at(0, 0);
    CHECK(ground < 0.1f);
    CHECK(holds(sheet, 26, 16, 23, 13, ground));
    CHECK(holds(sheet, 0, 0, 49, 3, ground));
    CHECK(holds(sheet, 23, 0, 3, 29, ground));
}

TEST_CASE("panels: a smaller panel is centred in its column at the top of its row", "[picture]") {
    const Image sheet = panels({plain(10, 20, 0.5f), plain(10, 10, 1), plain(30, 5, 2)}, {.columns = 2, .gap = 0});
    REQUIRE((sheet.width == 30 + 10 && sheet.height == 20 + 5));
    CHECK(holds(sheet, 10, 0, 10, 20, 0.5f));
    CHECK(holds(sheet, 30, 0, 10, 10, 1));
    CHECK(sheet.at(35, 15) < 0.1f);
    CHECK(holds(sheet, 0, 20, 30, 5, 2));
}

TEST_CASE("panels: by default up to three form a row and more a block", "[picture]") {
    const auto shape = [](size_t count) {
        const Image sheet = panels(std::vector<Image>(count, plain(10, 10, 0)), {.gap = 0});
        return std::pair(sheet.width / 10, sheet.height / 10);
    };
    CHECK(shape(1) == std::pair(1, 1));
    CHECK(shape(3) == std::pair(3, 1));
    CHECK(shape(4) == std::pair(2, 2));
    CHECK(shape(6) == std::pair(3, 2));
    CHECK(shape(7) == std::pair(3, 3));
}

TEST_CASE("panels: labels are drawn above their panels and fit their width", "[picture]") {
    const std::vector<Image> two(2, plain(400, 50, 0));
    const Image bare = panels(two), labelled = panels(two, {.labels = {"first", ""}});
    CHECK(ink(bare) == 0);
    CHECK(labelled.height > bare.height + 10);
    CHECK(labelled.width == bare.width);
    const int64_t letters = ink(labelled);
    CHECK(letters > 100);
    for (int y = 0; y < labelled.height; ++y)
        for (int x = labelled.width / 2; x < labelled.width; ++x) REQUIRE(labelled.at(x, y) < 0.1f);
    // A long label is smaller, and cut if it still does not fit.
    const Image longer = panels(two, {.labels = {std::string(60, 'i'), ""}}),
                tooLong = panels(two, {.labels = {std::string(1000, 'i'), ""}});
    CHECK(longer.height < labelled.height);
    CHECK(tooLong.width == bare.width);
    for (int y = 0; y < tooLong.height; ++y) REQUIRE(tooLong.at(bare.width / 2, y) < 0.1f);
}

TEST_CASE("panels: invalid images and options are refused", "[picture]") {
    CHECK_THROWS_AS(panels({}), ValueError);
    CHECK_THROWS_AS(panels({filledImage(4, 4, {"speed"})}), ValueError);
    CHECK_THROWS_AS(panels({Image{}}), ValueError);
    CHECK_THROWS_AS(panels({plain(4, 4, 0)}, {.columns = -1}), ValueError);
    CHECK_THROWS_WITH(panels({plain(4, 4, 0)}, {.labels = {"a", "b"}}), Catch::ContainsSubstring("2 labels for 1"));
    CHECK_THROWS_AS(panels({plain(4, 4, 0)}, {.gap = 40000}), ValueError);
}
