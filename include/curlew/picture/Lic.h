// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/picture/Image.h"

#include <array>
#include <cstdint>
#include <functional>
#include <string_view>

namespace curlew {

enum class LicKernel {
    hann, ///< Fades out smoothly, so streaks have no visible ends.
    box,  ///< Constant weights, as in the paper.
};
inline constexpr std::array<std::string_view, 2> kLicKernelNames{"hann", "box"};

struct LicOptions {
    double length = 48; ///< Streak length, pixels of arc: half of it on either side.
    LicKernel kernel = LicKernel::hann;
    double grain = 1.5; ///< Grain size of the noise, pixels.
    uint64_t seed = 0;
    double contrast = 0.2; ///< Standard deviation of the result about its mean, 1/2.

    static constexpr double kStep = 0.5; ///< Pixels of arc.
    /// Steps on either side: 1 to 1,000,000.
    int steps() const;
};

/// Averages noise along the streamline through each pixel: lic() before it sets the contrast. `noise` has one value per
/// grain.
Image convolved(const Image& vectors, const Image& noise, const LicOptions& options, const Monitor& monitor = {});

/// What does so in place of convolved(), such as a GPU.
using LicConvolution = std::function<Image(const Image&, const Image&, const LicOptions&, const Monitor&)>;

/// Line integral convolution (Cabral and Leedom 1993): averages white noise along the streamline through each pixel.
/// `vectors` has two channels, right and up; only the direction counts. Streamlines are traced by midpoint steps of
/// half a pixel through the vectors, bilinearly interpolated between pixel centres, and end at NaN and at the edge of
/// the picture. The result has one channel, "lic", with values in [0, 1]; NaN where the vectors are NaN, the noise
/// itself where they vanish.
///
/// Noise and result depend only on the pixel's position, not on the number of threads. Throws ValueError for other
/// channels, and if an option is not positive.
Image lic(const Image& vectors, const LicOptions& options = {}, const Monitor& monitor = {},
          const LicConvolution& convolution = convolved);

/// Modulates the brightness of a picture by a `lic` image of the same size; unchanged where that is NaN.
Image litBy(const Image& lic, Image picture);

} // namespace curlew
