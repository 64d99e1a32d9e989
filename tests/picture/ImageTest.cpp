// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/picture/Image.h"
#include "support/Catch.h"

using namespace curlew;

TEST_CASE("Image: channels are interleaved and rows start at the top", "[picture]") {
    Image image = filledImage(3, 2, {"a", "b"}, 7);
    REQUIRE(image.pixels == std::vector<float>(12, 7.0f));
    image.at(2, 1, 1) = 1;
    image.at(0, 1, 0) = 2;
    CHECK(image.pixels[11] == 1);
    CHECK(image.pixels[6] == 2);
    CHECK_NOTHROW(checkImage(image));
}

TEST_CASE("checkImage: inconsistent images are refused with their numbers", "[picture]") {
    CHECK_THROWS_WITH(filledImage(0, 5, {"a"}), Catch::ContainsSubstring("0 x 5"));
    CHECK_THROWS_AS(filledImage(5, -1, {"a"}), ValueError);
    CHECK_THROWS_AS(filledImage(1, 1, {}), ValueError);
    CHECK_THROWS_AS(filledImage(1, 1, {""}), ValueError);
    CHECK_THROWS_WITH(filledImage(1, 1, {"x", "y", "x"}), Catch::ContainsSubstring("'x'"));

    Image image = filledImage(4, 3, {"a"});
    image.pixels.pop_back();
    CHECK_THROWS_WITH(checkImage(image), Catch::ContainsSubstring("11 values; it needs 12"));
    CHECK_THROWS_AS(checkImage(Image{}), ValueError);
}
