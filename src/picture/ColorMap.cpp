// SPDX-License-Identifier: Apache-2.0
#include "curlew/picture/ColorMap.h"

#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/math/Percentile.h"
#include "curlew/picture/Display.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

namespace curlew {

namespace {

Vec3f fromHex(unsigned hex) {
    const auto part = [hex](int shift) { return static_cast<float>((hex >> shift) & 0xffu) / 255; };
    return {{part(16), part(8), part(0)}};
}

/// Twenty evenly spaced colours of viridis (CC0).
constexpr std::array<unsigned, 20> kViridisHex{0x440154, 0x481567, 0x482677, 0x453781, 0x404788, 0x39568C, 0x33638D,
                                               0x2D708E, 0x287D8E, 0x238A8D, 0x1F968B, 0x20A387, 0x29AF7F, 0x3CBB75,
                                               0x55C667, 0x73D055, 0x95D840, 0xB8DE29, 0xDCE319, 0xFDE725};

/// Evenly spaced colours, designed for this project.
constexpr std::array<unsigned, 6> kEmberHex{0x3A0B1E, 0x8C1A2B, 0xD43D1F, 0xF77F1E, 0xFDBE4A, 0xFFF1C0};
constexpr std::array<unsigned, 6> kIceHex{0x0B1240, 0x163E8C, 0x1F74C4, 0x2FB0DC, 0x86DDEA, 0xEEFBF7};

template <size_t Count>
std::array<Vec3f, Count> tableOf(const std::array<unsigned, Count>& hex) {
    std::array<Vec3f, Count> table;
    std::transform(hex.begin(), hex.end(), table.begin(), fromHex);
    return table;
}

/// CIE L*a*b* in spherical coordinates (Moreland 2009, section 4): length, angle from the L axis, hue.
struct Msh {
    double M, s, h;
};

Vec3f displayColor(const Msh& color) {
    const double L = color.M * std::cos(color.s);
    const double a = color.M * std::sin(color.s) * std::cos(color.h);
    const double b = color.M * std::sin(color.s) * std::sin(color.h);

    // CIE 1976, reference white D65.
    const auto decode = [](double f) { return f > 6.0 / 29 ? f * f * f : 3 * (36.0 / 841) * (f - 4.0 / 29); };
    const double fy = (L + 16) / 116;
    const double X = 0.95047 * decode(fy + a / 500), Y = decode(fy), Z = 1.08883 * decode(fy - b / 200);

    const Vec3d linear = linearFromXyz({{X, Y, Z}});
    Vec3f display;
    for (int i = 0; i < 3; ++i) display[i] = static_cast<float>(std::clamp(displayFromLinear(linear[i]), 0.0, 1.0));
    return display;
}

/// The blue-red map of Moreland 2009. From either end the hue turns on the way to the neutral middle, so that colours
/// keep their distance although the middle is lighter than a saturated colour can be.
Vec3f movedToMiddle(const Msh& end, double weight) {
    constexpr double middleM = 88;
    const double spin = end.s * std::sqrt(middleM * middleM - end.M * end.M) / (end.M * std::sin(end.s));
    const double middleHue = end.h > -std::numbers::pi / 3 ? end.h + spin : end.h - spin;
    return displayColor({.M = std::lerp(end.M, middleM, weight),
                         .s = std::lerp(end.s, 0.0, weight),
                         .h = std::lerp(end.h, middleHue, weight)});
}

constexpr int kDivergingHalf = 64;

std::array<Vec3f, 2 * kDivergingHalf + 1> makeDiverging() {
    const Msh blue{80, 1.08, -1.1}, red{80, 1.08, 0.5};
    std::array<Vec3f, 2 * kDivergingHalf + 1> table;
    for (int i = 0; i <= kDivergingHalf; ++i) {
        const double weight = static_cast<double>(i) / kDivergingHalf;
        table[static_cast<size_t>(i)] = movedToMiddle(blue, weight);
        table[static_cast<size_t>(2 * kDivergingHalf - i)] = movedToMiddle(red, weight);
    }
    return table;
}

Vec3f interpolated(std::span<const Vec3f> table, float t) {
    const float position = t * static_cast<float>(table.size() - 1);
    const size_t i = std::min(static_cast<size_t>(position), table.size() - 2);
    const float weight = position - static_cast<float>(i);
    return table[i] * (1 - weight) + table[i + 1] * weight;
}

/// The scale of an image that has no values or only zeros.
ColorScale unitScale(ColorMap map) {
    return {.map = map, .lower = map == ColorMap::diverging ? -1.0f : 0.0f, .upper = 1};
}

/// Returns the scale from 0 to twice the value, in increasing order, so that the value is in the middle. Not for 0.
ColorScale scaleAround(float value, ColorMap map) {
    constexpr float most = std::numeric_limits<float>::max();
    const float size = std::abs(value);
    return {.map = map, .lower = std::max(value - size, -most), .upper = std::min(value + size, most)};
}

} // namespace

Vec3f colorAt(ColorMap map, float t) {
    static const auto viridis = tableOf(kViridisHex);
    static const auto diverging = makeDiverging();
    static const auto ember = tableOf(kEmberHex);
    static const auto ice = tableOf(kIceHex);
    if (std::isnan(t)) return kNoValueColor;
    t = std::clamp(t, 0.0f, 1.0f);
    switch (map) {
        case ColorMap::viridis:
            return interpolated(viridis, t);
        case ColorMap::diverging:
            return interpolated(diverging, t);
        case ColorMap::ember:
            return interpolated(ember, t);
        case ColorMap::ice:
            return interpolated(ice, t);
        case ColorMap::gray:
            break;
    }
    return {{t, t, t}};
}

ColorScale automaticScale(const Image& image, ColorMap map) {
    std::vector<float> values;
    values.reserve(image.pixels.size());
    std::copy_if(image.pixels.begin(), image.pixels.end(), std::back_inserter(values),
                 [](float value) { return std::isfinite(value); });
    if (values.empty()) return unitScale(map);

    const auto [least, greatest] = std::minmax_element(values.begin(), values.end());
    const float minimum = *least, maximum = *greatest;
    float lower = percentile(values, 0.005, PercentileRank::nearest);
    float upper = percentile(values, 0.995, PercentileRank::nearest);
    // Few pixels differ from a constant background: show their full range.
    if (lower == upper) lower = minimum, upper = maximum;

    if (map == ColorMap::viridis && minimum >= 0) lower = 0;
    if (map == ColorMap::diverging) {
        upper = std::max(std::abs(lower), std::abs(upper));
        lower = -upper;
    }
    if (lower < upper) return {.map = map, .lower = lower, .upper = upper};
    return upper == 0 ? unitScale(map) : scaleAround(upper, map);
}

ColorScale commonScale(const std::vector<Image>& images, ColorMap map) {
    Image all{.width = 1, .height = 0, .channels = {"all"}, .pixels = {}};
    for (const Image& image : images)
        if (image.channels.size() == 1) all.pixels.insert(all.pixels.end(), image.pixels.begin(), image.pixels.end());
    return automaticScale(all, map);
}

Image colorize(const Image& scalar, const ColorScale& scale) {
    checkImage(scalar);
    if (scalar.channels.size() != 1)
        throw ValueError(fmt::format("a colour map needs an image of one channel; this one has {} ({})",
                                     scalar.channels.size(), fmt::join(scalar.channels, ", ")));
    if (!std::isfinite(scale.lower) || !std::isfinite(scale.upper) || !(scale.lower < scale.upper))
        throw ValueError(
            fmt::format("a colour scale from {} to {} has no range; it needs two finite numbers, the lower first",
                        scale.lower, scale.upper));
    Image picture = filledImage(scalar.width, scalar.height, {"R", "G", "B"});
    const auto lower = static_cast<double>(scale.lower), range = static_cast<double>(scale.upper) - lower;
    parallelFor(scalar.pixels.size(), 1 << 14, [&](size_t begin, size_t end) {
        for (size_t k = begin; k < end; ++k) {
            const double t = (static_cast<double>(scalar.pixels[k]) - lower) / range;
            const Vec3f color = colorAt(scale.map, static_cast<float>(t));
            std::copy(color.c.begin(), color.c.end(), &picture.pixels[3 * k]);
        }
    });
    return picture;
}

} // namespace curlew
