// SPDX-License-Identifier: Apache-2.0
#include "curlew/picture/Composite.h"

#include "curlew/base/Error.h"
#include "curlew/picture/Display.h"

#include <algorithm>

namespace curlew {

namespace {

/// Returns the values of a channel, pixel by pixel; empty if there is no such channel.
std::vector<float> channelOf(const Image& image, std::string_view name) {
    const size_t count = image.channels.size();
    const auto found = std::find(image.channels.begin(), image.channels.end(), name);
    std::vector<float> values;
    if (found == image.channels.end()) return values;
    for (auto k = static_cast<size_t>(found - image.channels.begin()); k < image.pixels.size(); k += count)
        values.push_back(image.pixels[k]);
    return values;
}

} // namespace

std::vector<float> depthOf(const Image& image) { return channelOf(image, "Z"); }

Image composite(const Image& top, const Image& picture) {
    const auto places = rgbChannels(picture);
    if (top.channels != std::vector<std::string>{"R", "G", "B", "A", "Z"} || !places || top.width != picture.width ||
        top.height != picture.height)
        throw ValueError(
            "an image with channels R, G, B, A, Z can only go over a picture of the same size with channels R, G, B");
    const std::vector<float> coverage = channelOf(picture, "A"), depth = depthOf(picture);
    const size_t channels = picture.channels.size();
    Image sum = top;
    for (size_t k = 0; k < sum.pixels.size() / 5; ++k) {
        float* const to = &sum.pixels[5 * k];
        const auto cover = static_cast<double>(to[3]);
        for (size_t i = 0; i < 3; ++i) {
            const double below = linearFromDisplay(static_cast<double>(picture.pixels[channels * k + (*places)[i]]));
            to[i] = static_cast<float>(
                displayFromLinear(below + cover * (linearFromDisplay(static_cast<double>(to[i])) - below)));
        }
        to[3] = 1 - (1 - to[3]) * (1 - (coverage.empty() ? 0 : coverage[k]));
        if (!depth.empty()) to[4] = std::min(to[4], depth[k]);
    }
    return sum;
}

} // namespace curlew
