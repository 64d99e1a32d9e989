// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/picture/ColorMap.h"
#include "curlew/picture/Image.h"

#include <string_view>

namespace curlew {

/// The image in colour (colorize) above a dark strip with the title, a colour bar and the numbers at its ends; an RGB
/// picture for writePng. Its size depends on the size of the image alone: the strip is 56 pixels high, 28 below an
/// image narrower than 312 pixels, more below one of 1536 or wider; an image narrower than 156 is centred in that
/// width. A title too long for the width is written smaller, then cut. The title may have letters (shown small), digits
/// and . , : + - * / = ( ) _ % ^ and spaces; others show as a box. Throws ValueError as colorize does.
Image withLegend(const Image& scalar, const ColorScale& scale, std::string_view title);

} // namespace curlew
