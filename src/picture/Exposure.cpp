// SPDX-License-Identifier: Apache-2.0
#include "curlew/picture/Exposure.h"

#include "curlew/base/Parallel.h"
#include "curlew/base/Require.h"
#include "curlew/math/Percentile.h"
#include "curlew/picture/Display.h"

#include <algorithm>
#include <cmath>

namespace curlew {

namespace {

void checkLight(const Image& light) {
    checkImage(light);
    if (light.channels != std::vector<std::string>{"R", "G", "B"})
        throw ValueError(
            fmt::format("light needs the channels R, G, B; this image has {}", fmt::join(light.channels, ", ")));
}

/// Replaces each value by the mean of the 2·half + 1 values around it, `step` apart; values beyond the ends count as 0.
void boxFilter(float* values, size_t count, size_t step, size_t half, std::vector<double>& sums) {
    sums.assign(count + 1, 0);
    for (size_t k = 0; k < count; ++k) sums[k + 1] = sums[k] + static_cast<double>(values[k * step]);
    const double scale = 1 / static_cast<double>(2 * half + 1);
    for (size_t k = 0; k < count; ++k)
        values[k * step] =
            static_cast<float>((sums[std::min(k + half + 1, count)] - sums[k - std::min(k, half)]) * scale);
}

/// Approximates a Gaussian blur by three box filters in each direction.
Image blurred(Image image, size_t half, const Monitor& monitor) {
    const auto width = static_cast<size_t>(image.width), height = static_cast<size_t>(image.height);
    for (const bool across : {true, false})
        parallelFor(
            across ? height : width, 16,
            [&](size_t begin, size_t end) {
                std::vector<double> sums;
                for (size_t line = begin; line < end; ++line)
                    for (size_t channel = 0; channel < 3; ++channel)
                        for (int pass = 0; pass < 3; ++pass)
                            boxFilter(&image.pixels[3 * line * (across ? width : 1) + channel], across ? width : height,
                                      across ? 3 : 3 * width, half, sums);
            },
            monitor);
    return image;
}

} // namespace

double automaticExposure(const Image& light) {
    checkLight(light);
    std::vector<float> lit;
    for (size_t k = 0; k < light.pixels.size(); k += 3) {
        const float most = std::max({light.pixels[k], light.pixels[k + 1], light.pixels[k + 2]});
        if (most > 0.01f && std::isfinite(most)) lit.push_back(most);
    }
    if (lit.empty()) return 1;
    return 1 / static_cast<double>(percentile(lit, 0.95, PercentileRank::lower));
}

Image withGlow(const Image& light, double part, const Monitor& monitor) {
    checkLight(light);
    if (!(part >= 0 && part <= 1)) throw ValueError(fmt::format("glow {} must be between 0 and 1", part));
    if (part == 0) return light;
    const double edge = std::max(light.width, light.height);
    // Three box filters of half width h have a standard deviation of about h.
    const auto half = [&](double size) { return static_cast<size_t>(std::lround(std::max(edge * size / 2, 1.0))); };
    const Image near = blurred(light, half(0.01), monitor), wide = blurred(near, half(0.03), monitor);
    Image sum = light;
    const auto kept = static_cast<float>(1 - part), spread = static_cast<float>(part / 2);
    for (size_t k = 0; k < sum.pixels.size(); ++k)
        sum.pixels[k] = kept * sum.pixels[k] + spread * (near.pixels[k] + wide.pixels[k]);
    return sum;
}

Image developed(const Image& light, double exposure, Image ground) {
    checkLight(light);
    requirePositive(exposure, "the exposure");
    const auto places = rgbChannels(ground);
    if (!places || ground.width != light.width || ground.height != light.height)
        throw ValueError("light can only be added to a picture of the same size with channels R, G, B");
    const size_t channels = ground.channels.size(), pixels = light.pixels.size() / 3;
    parallelFor(pixels, 4096, [&](size_t begin, size_t end) {
        for (size_t k = begin; k < end; ++k) {
            Vec3d c;
            for (int i = 0; i < 3; ++i)
                c[i] = std::max(static_cast<double>(light.pixels[3 * k + static_cast<size_t>(i)]) * exposure, 0.0);
            const double most = std::max({c[0], c[1], c[2]});
            if (!(most > 0)) continue;
            const double shown = -std::expm1(-most), pale = 0.6 * shown * shown * shown * shown;
            for (size_t i = 0; i < 3; ++i) {
                const double hue = c[static_cast<int>(i)] / most, lit = shown * (hue + (1 - hue) * pale);
                float& to = ground.pixels[channels * k + (*places)[i]];
                const double below = linearFromDisplay(static_cast<double>(to));
                to = static_cast<float>(displayFromLinear(below + lit * std::max(1 - below, 0.0)));
            }
        }
    });
    return ground;
}

} // namespace curlew
