// SPDX-License-Identifier: Apache-2.0
#include "curlew/picture/Image.h"

#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <algorithm>

namespace curlew {

namespace {

void checkShape(int width, int height, const std::vector<std::string>& channels) {
    if (width < 1 || height < 1)
        throw ValueError(fmt::format("an image of {} x {} pixels is empty; it needs at least 1 x 1", width, height));
    if (channels.empty()) throw ValueError("an image without channels is empty; it needs at least one");
    for (auto name = channels.begin(); name != channels.end(); ++name) {
        if (name->empty()) throw ValueError("an image has a channel without a name");
        if (std::find(channels.begin(), name, *name) != name)
            throw ValueError(fmt::format("an image has two channels named '{}'; name them differently", *name));
    }
}

size_t valueCount(int width, int height, size_t channels) {
    return static_cast<size_t>(width) * static_cast<size_t>(height) * channels;
}

} // namespace

Image filledImage(int width, int height, std::vector<std::string> channels, float value) {
    checkShape(width, height, channels);
    Image image{.width = width, .height = height, .channels = std::move(channels), .pixels = {}};
    image.pixels.assign(valueCount(width, height, image.channels.size()), value);
    return image;
}

void checkImage(const Image& image) {
    checkShape(image.width, image.height, image.channels);
    const size_t expected = valueCount(image.width, image.height, image.channels.size());
    if (image.pixels.size() != expected)
        throw ValueError(fmt::format("an image of {} x {} pixels with {} channels has {} values; it needs {}",
                                     image.width, image.height, image.channels.size(), image.pixels.size(), expected));
}

} // namespace curlew
