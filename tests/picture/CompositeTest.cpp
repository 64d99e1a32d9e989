// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/picture/Composite.h"
#include "curlew/picture/Display.h"
#include "support/Catch.h"

#include <limits>

using namespace curlew;

namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

/// Three pixels with coverage 0, 1/2 and 1.
Image top() {
    return {.width = 3,
            .height = 1,
            .channels = {"R", "G", "B", "A", "Z"},
            .pixels = {0.1f, 0.2f, 0.3f, 0, kFar, 1, 0, 0, 0.5f, 2, 0.4f, 0.5f, 0.6f, 1, 7}};
}

} // namespace

TEST_CASE("composite: blends colours in linear light by coverage", "[picture]") {
    const Image ground = plainPicture(3, 1, {{0, 1, 0.25f}});
    const Image sum = composite(top(), ground);
    CHECK(sum.channels == top().channels);
    for (int i = 0; i < 3; ++i) {
        CAPTURE(i);
        CHECK(sum.at(0, 0, i) == Approx(ground.at(0, 0, i)).margin(1e-6));
        CHECK(linearFromDisplay(static_cast<double>(sum.at(1, 0, i))) ==
              Approx((linearFromDisplay(static_cast<double>(top().at(1, 0, i))) +
                      linearFromDisplay(static_cast<double>(ground.at(1, 0, i)))) /
                     2)
                  .margin(1e-6));
        CHECK(sum.at(2, 0, i) == Approx(top().at(2, 0, i)));
    }
    // The background has no coverage and no depth.
    for (int x = 0; x < 3; ++x) {
        CHECK(sum.at(x, 0, 3) == top().at(x, 0, 3));
        CHECK(sum.at(x, 0, 4) == top().at(x, 0, 4));
    }
    CHECK(depthOf(ground).empty());
    CHECK(depthOf(sum) == std::vector<float>{kFar, 2, 7});
}

TEST_CASE("composite: accumulates coverage and keeps the smaller depth", "[picture]") {
    Image ground = filledImage(3, 1, {"Z", "A", "B", "G", "R"});
    for (int x = 0; x < 3; ++x) ground.at(x, 0, 0) = 3, ground.at(x, 0, 1) = 0.5f, ground.at(x, 0, 4) = 1;
    const Image sum = composite(top(), ground);
    CHECK(sum.at(0, 0, 0) == Approx(1));
    CHECK(sum.at(0, 0, 2) == Approx(0).margin(1e-6));
    CHECK(sum.at(0, 0, 3) == 0.5f);
    CHECK(sum.at(1, 0, 3) == 0.75f);
    CHECK(sum.at(2, 0, 3) == 1);
    CHECK(depthOf(sum) == std::vector<float>{3, 2, 3});
}

TEST_CASE("composite: mismatched channels or sizes are refused", "[picture]") {
    CHECK_THROWS_AS(composite(top(), plainPicture(2, 1, {})), ValueError);
    CHECK_THROWS_AS(composite(top(), filledImage(3, 1, {"value"})), ValueError);
    CHECK_THROWS_AS(composite(plainPicture(3, 1, {}), plainPicture(3, 1, {})), ValueError);
}
