// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/picture/Image.h"

#include <array>
#include <cstdint>
#include <string_view>

namespace curlew {

enum class LicKernel {
    hann, ///< Smooth ends: no streaks that begin or end visibly.
    box,  ///< All alike, as in the paper.
};
inline constexpr std::array<std::string_view, 2> kLicKernelNames{"hann", "box"};

struct LicOptions {
    double length = 48; ///< Of a streak, pixels of arc: half of it to either side.
    LicKernel kernel = LicKernel::hann;
    double grain = 1.5; ///< Of the noise, pixels.
    uint64_t seed = 0;
    double contrast = 0.2; ///< The standard deviation that the result is stretched to, about its middle, 1/2.
};

/// Line integral convolution (Cabral and Leedom 1993): white noise, averaged along the streamline through each pixel.
/// `vectors` has two channels, to the right and up, of which only the direction counts; streamlines are followed by
/// midpoint steps of half a pixel through the vectors between the pixels' middles (bilinear), and end at NaN and at the
/// picture's edge. The result has one channel, "lic", with values in [0, 1], NaN where the vectors are; where they
/// vanish, the noise itself.
///
/// Noise and result depend on a pixel's place alone, not on the number of threads. Throws ValueError for other
/// channels, and for options that are not positive.
Image lic(const Image& vectors, const LicOptions& options = {}, const Monitor& monitor = {});

/// A picture with the light and dark of a `lic` image of the same size: where that is NaN, unchanged.
Image litBy(const Image& lic, const Image& picture);

} // namespace curlew
