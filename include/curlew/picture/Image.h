// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace curlew {

/// A floating-point image: rows from top to bottom, channels interleaved. NaN means that a pixel has no value.
struct Image {
    int width = 0, height = 0;
    std::vector<std::string> channels; ///< One name per channel ("speed"; or "R", "G", "B"; …).
    std::vector<float> pixels;         ///< width * height * channels.size() values.

    float& at(int x, int y, int channel = 0) { return pixels[index(x, y, channel)]; }
    float at(int x, int y, int channel = 0) const { return pixels[index(x, y, channel)]; }

  private:
    size_t index(int x, int y, int channel) const {
        return (static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)) * channels.size() +
               static_cast<size_t>(channel);
    }
};

/// Returns an image that has `value` everywhere. Throws ValueError like checkImage.
Image filledImage(int width, int height, std::vector<std::string> channels, float value = 0);

/// Throws ValueError unless the image has at least one pixel, channels with different names, and as many values as its
/// size requires.
void checkImage(const Image& image);

} // namespace curlew
