// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/picture/ColorMap.h"
#include "curlew/picture/Image.h"

#include <array>
#include <optional>

namespace curlew {

// Pictures hold sRGB display values (IEC 61966-2-1). What is brighter than white is above 1; the curve goes on there,
// and below 0 as its mirror image.

double displayFromLinear(double linear);
double linearFromDisplay(double display);

/// Linear sRGB of the CIE 1931 tristimulus values X, Y, Z, where white (D65) has Y = 1; not clamped.
Vec3d linearFromXyz(const Vec3d& xyz);

/// The places of channels R, G and B; nothing where one of them is missing.
std::optional<std::array<size_t, 3>> rgbChannels(const Image& image);

/// A picture of one colour: channels R, G, B in display values. Throws ValueError as checkImage does.
Image plainPicture(int width, int height, const Vec3f& color);

/// Whether the channels are the components of a vector: velocity.x, velocity.y, velocity.z.
bool isVector(const Image& image);

/// What one sees of an image: a picture with the channels R, G, B and no others, from its channels of those names, from
/// its only channel by the scale (colorize), or from the three of a vector, x as red, y as green, z as blue, none of it
/// at the lower end of the scale. Throws ValueError for an image that is not whole (checkImage), and for other
/// channels.
Image displayed(const Image& image, const ColorScale& scale = {});

} // namespace curlew
