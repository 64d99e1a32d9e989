// SPDX-License-Identifier: Apache-2.0
#include "curlew/picture/Display.h"

#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

namespace curlew {

double displayFromLinear(double linear) {
    const double size = std::abs(linear);
    return std::copysign(size <= 0.0031308 ? 12.92 * size : 1.055 * std::pow(size, 1 / 2.4) - 0.055, linear);
}

double linearFromDisplay(double display) {
    const double size = std::abs(display);
    return std::copysign(size <= 0.04045 ? size / 12.92 : std::pow((size + 0.055) / 1.055, 2.4), display);
}

Vec3d linearFromXyz(const Vec3d& xyz) {
    return {{3.2404542 * xyz[0] - 1.5371385 * xyz[1] - 0.4985314 * xyz[2],
             -0.9692660 * xyz[0] + 1.8760108 * xyz[1] + 0.0415560 * xyz[2],
             0.0556434 * xyz[0] - 0.2040259 * xyz[1] + 1.0572252 * xyz[2]}};
}

std::optional<std::array<size_t, 3>> rgbChannels(const Image& image) {
    std::array<size_t, 3> places{};
    constexpr std::array<std::string_view, 3> names{"R", "G", "B"};
    for (size_t i = 0; i < 3; ++i) {
        const auto found = std::find(image.channels.begin(), image.channels.end(), names[i]);
        if (found == image.channels.end()) return {};
        places[i] = static_cast<size_t>(found - image.channels.begin());
    }
    return places;
}

Image plainPicture(int width, int height, const Vec3f& color) {
    Image picture = filledImage(width, height, {"R", "G", "B"});
    for (size_t k = 0; k < picture.pixels.size(); ++k) picture.pixels[k] = color[static_cast<int>(k % 3)];
    return picture;
}

bool isVector(const Image& image) {
    if (image.channels.size() != 3) return false;
    const std::string stem =
        image.channels[0].substr(0, image.channels[0].size() - std::min<size_t>(2, image.channels[0].size()));
    return image.channels == std::vector<std::string>{stem + ".x", stem + ".y", stem + ".z"};
}

namespace {

Image components(const Image& vectors, const ColorScale& scale) {
    Image picture = vectors;
    picture.channels = {"R", "G", "B"};
    for (float& value : picture.pixels)
        if (!std::isnan(value)) value = std::clamp((value - scale.lower) / (scale.upper - scale.lower), 0.0f, 1.0f);
    return picture;
}

} // namespace

Image displayed(const Image& image, const ColorScale& scale) {
    checkImage(image);
    if (image.channels.size() == 1) return colorize(image, scale);
    if (isVector(image)) return components(image, scale);
    const auto places = rgbChannels(image);
    if (!places)
        throw ValueError(
            fmt::format("an image with channels {} cannot be shown in colour: it needs one channel, a vector's three, "
                        "or R, G, B among them; write an .exr instead",
                        fmt::join(image.channels, ", ")));
    Image picture = filledImage(image.width, image.height, {"R", "G", "B"});
    const size_t count = image.channels.size();
    for (size_t pixel = 0; pixel < picture.pixels.size() / 3; ++pixel)
        for (size_t i = 0; i < 3; ++i) picture.pixels[3 * pixel + i] = image.pixels[count * pixel + (*places)[i]];
    return picture;
}

} // namespace curlew
