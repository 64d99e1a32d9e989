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
    double time = 0.5; ///< Seconds that the positions of the pixels move along the flow; negative: against it.
    int steps = 0;     ///< Of equal length; 0: as long as `accuracy` allows.
    std::optional<Scheme> scheme = {}; ///< As in AdvectOptions.
    /// Corrections by Newton's method after each step (ICN Eq. 12), always as many: without tolerances and limits, as
    /// the paper has it. For particles, which must not jump, there is track/Advect.h.
    int reprojections = 1;
    int supersampling = 1; ///< Of pictures: positions per pixel along each edge, averaged.
    double accuracy = 0;   ///< As in AdvectOptions: of a step, world units; 0: a millionth of the domain's diagonal.

    bool adaptive() const { return steps == 0 || accuracy > 0; } ///< With both, the accuracy rules.
};

/// Moves positions along the flow (ICN Algorithm 1 in 2D, where f is constant along streamlines), each by steps of its
/// own length or all by equal ones. No position depends on another, nor on the number of threads. Throws ValueError for
/// a flow that is a sum, unless reprojections = 0, for values that are not finite, negative steps and reprojections,
/// and an accuracy for a scheme that does not estimate its error.
void warp(const FlowN<2>& flow, std::vector<Vec<double, 2>>& positions, const WarpOptions& options,
          const Monitor& monitor = {});

/// The colour at a position, as display values.
using Texture2 = std::function<Vec3f(const Vec<double, 2>& position)>;

/// What pictures of Fig. 5 of ICN are made of: waves in the colours of viridis.
Vec3f wavePattern(const Vec<double, 2>& position);

/// An image as a texture on a box, bilinear between the middles of its pixels, and the colour of its edge beyond it.
/// R, G, B only (displayed()). Throws ValueError for others.
Texture2 textureOf(const Image& picture, const BoxN<2>& box);

/// The picture of a texture that has been carried along: each pixel shows the colour where its middle goes by warp(),
/// or the mean of several places in it. `box` fills the picture; pixels are square if width and height fit it. Throws
/// as warp() does, and for sizes below 1 and an empty box; ResourceError where the memory would not do.
Image warpedPicture(const FlowN<2>& flow, const Texture2& texture, const BoxN<2>& box, int width, int height,
                    const WarpOptions& options, const Monitor& monitor = {});

/// How two images of the same size differ, channel by channel, over all values that both have.
struct ImageDifference {
    double rms = 0, largest = 0;
    size_t unmatched = 0; ///< Values that only one of them has: the other is NaN.
};
/// Throws ValueError for images of other sizes or numbers of channels than each other's.
ImageDifference differenceOf(const Image& a, const Image& b);

} // namespace curlew
