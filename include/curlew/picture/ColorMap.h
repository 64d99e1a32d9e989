// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"
#include "curlew/picture/Image.h"

#include <array>
#include <string_view>
#include <vector>

namespace curlew {

/// How a number becomes a colour.
enum class ColorMap {
    viridis,   ///< Dark violet to yellow, lightness rising evenly: for magnitudes (Smith and van der Walt 2015).
    diverging, ///< Blue, light grey, red: for signed values (Moreland 2009, "Diverging Color Maps").
    gray,      ///< Black to white, even in display values.
    ember,     ///< Dark red over orange to pale yellow: for light on a dark ground.
    ice        ///< Dark blue over cyan to nearly white, likewise.
};
inline constexpr std::array<std::string_view, 5> kColorMapNames{"viridis", "diverging", "gray", "ember", "ice"};

/// What a pixel without a value (NaN) looks like: a dark neutral that no map but `gray` contains.
inline constexpr Vec3f kNoValueColor{{0.12f, 0.12f, 0.12f}};

/// The colour at t, clamped to [0, 1]: sRGB display values in [0, 1]. NaN gives `kNoValueColor`.
/// Accuracy: viridis within 0.017 of the published table of 256 colours, diverging within 0.001 of its definition.
Vec3f colorAt(ColorMap map, float t);

/// A map laid over the values from `lower` to `upper`; values beyond take the colour of the nearer end.
struct ColorScale {
    ColorMap map = ColorMap::viridis;
    float lower = 0, upper = 1; ///< In units of the image's values; finite, lower < upper.
};

/// The range that shows most of an image: its percentiles 0.5 and 99.5, over all channels, without NaN and infinities.
/// `viridis` starts at 0 if no value is negative; `diverging` is symmetric about 0. A constant image gets a range
/// around its value, one without values [0, 1] or [-1, 1]: always lower < upper.
ColorScale automaticScale(const Image& image, ColorMap map);

/// One scale for all images of one channel: the automatic scale of their values together.
ColorScale commonScale(const std::vector<Image>& images, ColorMap map);

/// The image as a picture with channels R, G, B in sRGB display values. Throws ValueError for an image that is not
/// whole (checkImage) or has more than one channel, and for a scale without a finite range.
Image colorize(const Image& scalar, const ColorScale& scale);

} // namespace curlew
