// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/math/Vec.h"
#include "curlew/picture/Image.h"

namespace curlew {

/// The exposure at which most of what is lit shows: the percentile 95 of the pixels that are lit at all, each by its
/// brightest channel, becomes 1. 1 for an image without light. `light` has the channels R, G, B in linear light.
double automaticExposure(const Image& light);

/// Light with a halo: `part` of it, 0 to 1, is spread over about a hundredth and a thirtieth of the picture's longer
/// edge (repeated box filters); the sum over the picture stays the same but for what leaves it.
Image withGlow(const Image& light, double part, const Monitor& monitor = {});

/// Light that shines onto a picture: linear light times `exposure`, with a shoulder instead of a limit, so that nothing
/// turns into flat white: a channel value m, the greatest of a pixel, becomes 1 - exp(-m), its hue stays, and what is
/// very bright gets paler. `ground` has at least the channels R, G, B, display values; what is bright there gets less
/// of it (screen blending). Its other channels stay. Throws ValueError where the sizes or channels do not fit, or the
/// exposure is not positive and finite.
Image developed(const Image& light, double exposure, Image ground);

} // namespace curlew
