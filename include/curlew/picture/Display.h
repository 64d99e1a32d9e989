// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/picture/ColorMap.h"
#include "curlew/picture/Image.h"

#include <array>
#include <optional>

namespace curlew {

// Pictures hold sRGB display values (IEC 61966-2-1). Values brighter than white are above 1; the transfer curve
// continues there, and below 0 as its mirror image.

double displayFromLinear(double linear);
double linearFromDisplay(double display);

/// Returns the linear sRGB of the CIE 1931 tristimulus values X, Y, Z, where white (D65) has Y = 1; not clamped.
Vec3d linearFromXyz(const Vec3d& xyz);

/// Returns the indices of channels R, G and B; nullopt if one of them is missing.
std::optional<std::array<size_t, 3>> rgbChannels(const Image& image);

/// Returns a picture of one colour with channels R, G, B in display values. Throws ValueError like checkImage.
Image plainPicture(int width, int height, const Vec3f& color);

/// Returns whether the channels are the components of a vector: velocity.x, velocity.y, velocity.z.
bool isVector(const Image& image);

/// Returns the displayed form of an image: a picture with exactly the channels R, G, B. An image with those channels
/// keeps them; a single channel is coloured by the scale (colorize); a vector's components x, y, z become red, green,
/// blue, 0 at the lower end of the scale and 1 at its upper end. Throws ValueError if the image is invalid (checkImage)
/// or has other channels.
Image displayed(const Image& image, const ColorScale& scale = {});

} // namespace curlew
