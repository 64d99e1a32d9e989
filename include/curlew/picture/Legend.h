// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/picture/ColorMap.h"
#include "curlew/picture/Image.h"

#include <string_view>

namespace curlew {

/// Returns the image in colour (colorize) above a dark strip with the title, a colour bar and the numbers at its ends,
/// as an RGB picture for writePng. The picture's size depends only on the image's size: the strip is 56 pixels high, 28
/// if the image is narrower than 312 pixels, more if it is 1536 or wider. An image narrower than 156 pixels is centred
/// in that width. A title that is too long is written smaller, then cut. It may have letters (shown in lower case),
/// digits, spaces and . , : + - * / = ( ) _ % ^; other characters show as a box. Throws ValueError like colorize.
Image withLegend(const Image& scalar, const ColorScale& scale, std::string_view title);

} // namespace curlew
