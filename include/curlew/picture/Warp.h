// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Flow.h"
#include "curlew/picture/Image.h"
#include "curlew/track/Stepper.h"

#include <functional>
#include <optional>
#include <vector>

namespace curlew {

struct WarpOptions {
    double time = 0.5; ///< Seconds for which pixel positions move along the flow; negative: against it.
    int steps = 0;     ///< Number of equal steps; 0: adaptive steps, whose length `accuracy` determines.
    std::optional<Scheme> scheme = {}; ///< As in AdvectOptions.
    /// Number of corrections by Newton's method after each step (ICN Eq. 12); fewer only if f is exact to rounding.
    /// Equal steps do not limit the length of a correction, as in the paper, so positions may jump; use track/Advect.h
    /// for particles.
    int corrections = 1;
    int supersampling = 1; ///< For pictures: positions along each edge of a pixel, averaged.
    double accuracy = 0;   ///< Per step, world units, as in AdvectOptions; 0: a millionth of the domain's diagonal.

    bool adaptive() const { return steps == 0 || accuracy > 0; } ///< If both are given, the steps are adaptive.
    /// Throws ValueError if a value is out of range, or if corrections are asked for in a flow without tracks.
    void validate(const FlowN<2>& flow) const;
};

/// Moves positions along the flow (ICN Algorithm 1 in 2D, where f is constant along streamlines), by adaptive or equal
/// steps. No position influences another, so the result does not depend on the number of threads. Throws ValueError if
/// the flow is a sum and corrections > 0, a value is not finite, the number of steps or corrections is negative, or
/// an accuracy is given for a scheme without error estimates.
void warp(const FlowN<2>& flow, std::vector<Vec<double, 2>>& positions, const WarpOptions& options,
          const Monitor& monitor = {});

/// Returns the colour at a position, as display values. The textures here return kNoValueColor (ColorMap.h) if a
/// coordinate is not finite.
using Texture2 = std::function<Vec3f(const Vec<double, 2>& position)>;

/// The pattern of ICN Fig. 5: waves in the colours of viridis.
Vec3f wavePattern(const Vec<double, 2>& position);

/// Returns an image as a texture on a box, bilinear between its pixel centres; outside, the colour of its edge. Uses
/// displayed(). Throws ValueError if that does or if the box is empty or infinite.
Texture2 textureOf(const Image& picture, const BoxN<2>& box);

/// What moves positions in place of warp(), such as a GPU.
using Warper = std::function<void(const FlowN<2>&, std::vector<Vec<double, 2>>&, const WarpOptions&, const Monitor&)>;

/// Returns the picture of an advected texture: each pixel shows the colour at the position to which warp() moves its
/// centre, or the mean of several positions in the pixel. `box` fills the picture; pixels are square if width and
/// height fit the box. Throws like warp(), and ValueError if a size is below 1 or the box is empty or infinite;
/// ResourceError if it does not fit into memory.
Image warpedPicture(const FlowN<2>& flow, const Texture2& texture, const BoxN<2>& box, int width, int height,
                    const WarpOptions& options, const Monitor& monitor = {}, const Warper& warper = warp);

/// The difference of two images of the same size, channel by channel, over all values that both have.
struct ImageDifference {
    double rms = 0, largest = 0;
    size_t unmatched = 0; ///< Values that are NaN in only one of the two.
};
/// Throws ValueError if the images differ in size or number of channels.
ImageDifference differenceOf(const Image& a, const Image& b);

} // namespace curlew
