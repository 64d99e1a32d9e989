#pragma once

#include <string>
#include <vector>

namespace curlew {

/// A picture in floating point, rows from top to bottom, channels interleaved. NaN means: nothing is there.
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

} // namespace curlew
