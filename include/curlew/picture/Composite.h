// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/picture/Image.h"

#include <vector>

namespace curlew {

/// The depth of each pixel: the channel Z. Empty if the image has none.
std::vector<float> depthOf(const Image& image);

/// Lays an image with the channels R, G, B, A, Z (in this order, display values, not multiplied by A) over a picture of
/// the same size. The colours are mixed in linear light by A; A is the part that either covers, Z the lesser depth. The
/// picture needs R, G, B; without A it covers nothing, without Z it has no depth. Throws ValueError if the channels or
/// sizes do not fit.
Image composite(const Image& top, const Image& picture);

} // namespace curlew
