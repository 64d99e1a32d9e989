// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/math/Vec.h"
#include "curlew/picture/Image.h"

namespace curlew {

/// Returns the exposure that maps percentile 95 of the lit pixels, each by its brightest channel, to 1. Returns 1 if
/// the image has no light. `light` has the channels R, G, B in linear light.
double automaticExposure(const Image& light);

/// Adds a halo to light. The fraction `part`, 0 to 1, of the light is spread over about 1/100 and 1/30 of the picture's
/// longer edge (repeated box filters). The sum over the picture is preserved except for light that leaves it.
Image withGlow(const Image& light, double part, const Monitor& monitor = {});

/// Adds light to a picture. The linear light is multiplied by `exposure` and compressed smoothly instead of clipped, so
/// that nothing becomes flat white: the largest channel value m of a pixel becomes 1 - exp(-m), the hue stays, and very
/// bright colours become paler. `ground` has at least the channels R, G, B in display values; it receives less light
/// where it is bright (screen blending). Its other channels stay. Throws ValueError if the sizes or channels do not
/// fit, or if the exposure is not positive and finite.
Image developed(const Image& light, double exposure, Image ground);

} // namespace curlew
