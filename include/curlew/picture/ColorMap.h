// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"
#include "curlew/picture/Image.h"

#include <array>
#include <string_view>
#include <vector>

namespace curlew {

/// Maps a number to a colour.
enum class ColorMap {
    viridis, ///< Dark violet to yellow with evenly increasing lightness, for magnitudes (Smith and van der Walt 2015).
    diverging, ///< Blue, light grey, red, for signed values (Moreland 2009, "Diverging Color Maps").
    gray,      ///< Black to white, linear in display values.
    ember,     ///< Dark red, orange, pale yellow, for light on a dark background.
    ice        ///< Dark blue, cyan, nearly white, for light on a dark background.
};
inline constexpr std::array<std::string_view, 5> kColorMapNames{"viridis", "diverging", "gray", "ember", "ice"};

/// The colour of a pixel without a value (NaN): a dark neutral that no map except `gray` contains.
inline constexpr Vec3f kNoValueColor{{0.12f, 0.12f, 0.12f}};

/// Returns the colour at t, clamped to [0, 1], as sRGB display values in [0, 1]. NaN gives `kNoValueColor`. Accuracy:
/// viridis within 0.017 of the published table of 256 colours, diverging within 0.001 of its definition.
Vec3f colorAt(ColorMap map, float t);

/// Applies a colour map to the values from `lower` to `upper`; values outside take the colour of the nearer end.
struct ColorScale {
    ColorMap map = ColorMap::viridis;
    float lower = 0, upper = 1; ///< In units of the image's values; finite, lower < upper.
};

/// Returns the range from percentile 0.5 to 99.5 of an image, over all channels, without NaN and infinities; the full
/// range if the two are equal. `viridis` starts at 0 if no value is negative; `diverging` is symmetric about 0. If that
/// leaves a single value, the range is from 0 to twice the value; if that is 0, or there are no values, [0, 1] or, for
/// `diverging`, [-1, 1]. So always lower < upper.
ColorScale automaticScale(const Image& image, ColorMap map);

/// Returns one scale for all images of one channel: the automatic scale of all their values.
ColorScale commonScale(const std::vector<Image>& images, ColorMap map);

/// Returns the image as a picture with channels R, G, B in sRGB display values. Throws ValueError if the image is
/// invalid (checkImage) or has more than one channel, or if the scale has no finite range.
Image colorize(const Image& scalar, const ColorScale& scale);

} // namespace curlew
