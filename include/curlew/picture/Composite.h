// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/picture/Image.h"

#include <vector>

namespace curlew {

/// Returns the depth of each pixel, the channel Z; empty if the image has none.
std::vector<float> depthOf(const Image& image);

/// Composites `top`, an image with the channels R, G, B, A, Z (in this order, display values, not premultiplied by A),
/// over a picture of the same size. The colours are mixed in linear light by A. In the result, A is the coverage by
/// either image and Z the smaller depth. `picture` needs R, G, B; its A defaults to 0 and its Z to infinity. Throws
/// ValueError if the channels or sizes do not fit.
Image composite(const Image& top, const Image& picture);

} // namespace curlew
