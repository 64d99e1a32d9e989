// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/ScalarField.h"
#include "curlew/picture/Image.h"

#include <string_view>

namespace curlew {

/// What is beyond the edges of a picture.
enum class ImageWrap {
    clamp,  ///< The pixels of the edge continue.
    repeat, ///< The picture is repeated.
    mirror, ///< The picture is repeated, every other time as its mirror image.
};
inline constexpr std::array<std::string_view, 3> kImageWrapNames{"clamp", "repeat", "mirror"};

/// Returns one channel of a picture as a field in the plane: a C² bicubic B-spline through the pixels with fourth-order
/// accuracy, which may exceed the range of the pixels at sharp edges. The picture's longer edge reaches from -1 to 1,
/// its centre is at the origin, and its top is towards +y. Values are those of the image. With `channel` empty: the
/// only channel, or of R, G and B the luminance (Rec. 709). Throws ValueError if there is no such channel, or if a
/// pixel is not finite.
ScalarFieldN<2> imageField(const Image& image, std::string_view channel = "", ImageWrap wrap = ImageWrap::clamp);

} // namespace curlew
