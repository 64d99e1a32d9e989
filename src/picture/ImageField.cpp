// SPDX-License-Identifier: Apache-2.0
#include "curlew/picture/ImageField.h"

#include "curlew/base/Error.h"
#include "curlew/math/CubicBSpline.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace curlew {

namespace {

int wrapped(int i, int size, ImageWrap wrap) {
    const auto modulo = [](int a, int n) { return a % n < 0 ? a % n + n : a % n; };
    switch (wrap) {
        case ImageWrap::repeat:
            return modulo(i, size);
        case ImageWrap::mirror:
            return std::min(modulo(i, 2 * size), 2 * size - 1 - modulo(i, 2 * size));
        case ImageWrap::clamp:
            break;
    }
    return std::clamp(i, 0, size - 1);
}

/// A bicubic B-spline.
class ImageSpline {
  public:
    ImageSpline(int width, int height, const std::vector<float>& values, ImageWrap wrap)
        : mWidth(width), mHeight(height), mWrap(wrap), mPixel(2.0 / std::max(width, height)), mCoefficients(values) {
        // Corrects the smoothing by the spline to fourth order, as SplineField does in 3D.
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const auto at = [&](int i, int j) { return static_cast<double>(values[index(i, j)]); };
                const double around = at(x - 1, y) + at(x + 1, y) + at(x, y - 1) + at(x, y + 1);
                mCoefficients[index(x, y)] = static_cast<float>(at(x, y) + (4 * at(x, y) - around) / 6);
            }
        const auto [least, most] = std::minmax_element(mCoefficients.begin(), mCoefficients.end());
        mRange = {static_cast<double>(*least), static_cast<double>(*most)};
    }

    static constexpr std::string_view kNotSymbolic = "an image";

    Interval range() const { return mRange; }

    template <int Order, class T>
    Jet<T, 2, Order> at(const Vec<double, 2>& position) const {
        constexpr double kFarthest = 0x1p29; // pixels; beyond, and for NaN, the value at the origin's pixel
        Vec<double, 2> pixel{{position[0] / mPixel + 0.5 * mWidth - 0.5, 0.5 * mHeight - 0.5 - position[1] / mPixel}};
        for (double& c : pixel.c)
            if (!(std::abs(c) < kFarthest)) c = 0;
        const Vec<double, 2> base{{std::floor(pixel[0]), std::floor(pixel[1])}};
        std::array<std::array<T, 4>, Order + 1> u, v; // weights by derivative
        for (int d = 0; d <= Order; ++d) {
            u[static_cast<size_t>(d)] = cubicBSplineWeights(static_cast<T>(pixel[0] - base[0]), d);
            v[static_cast<size_t>(d)] = cubicBSplineWeights(static_cast<T>(pixel[1] - base[1]), d);
        }
        std::array<std::array<T, Order + 1>, Order + 1> sum{}; // by the derivatives along x and y, per pixel
        for (size_t j = 0; j < 4; ++j) {
            std::array<T, Order + 1> row{};
            for (size_t i = 0; i < 4; ++i) {
                const auto c =
                    static_cast<T>(mCoefficients[index(static_cast<int>(base[0]) + static_cast<int>(i) - 1,
                                                       static_cast<int>(base[1]) + static_cast<int>(j) - 1)]);
                for (size_t d = 0; d <= Order; ++d) row[d] = mulAdd(c, u[d][i], row[d]);
            }
            for (size_t dx = 0; dx <= Order; ++dx)
                for (size_t dy = 0; dx + dy <= Order; ++dy) sum[dx][dy] = mulAdd(row[dx], v[dy][j], sum[dx][dy]);
        }
        const auto derivative = [&](size_t dx, size_t dy) { // rows run downwards
            const double scale = std::pow(mPixel, -static_cast<double>(dx + dy)) * (dy % 2 ? -1 : 1);
            return sum[dx][dy] * static_cast<T>(scale);
        };
        Jet<T, 2, Order> jet(sum[0][0]);
        if constexpr (Order >= 1) jet.gradient = {{derivative(1, 0), derivative(0, 1)}};
        if constexpr (Order >= 2)
            jet.hessian(0, 0) = derivative(2, 0), jet.hessian(0, 1) = derivative(1, 1),
                           jet.hessian(1, 1) = derivative(0, 2);
        if constexpr (Order >= 3)
            jet.forTriples([&](int i, int j, int k) {
                const size_t alongY = static_cast<size_t>(i) + static_cast<size_t>(j) + static_cast<size_t>(k);
                jet.third(i, j, k) = derivative(3 - alongY, alongY);
            });
        return jet;
    }

  private:
    size_t index(int x, int y) const {
        return static_cast<size_t>(wrapped(y, mHeight, mWrap)) * static_cast<size_t>(mWidth) +
               static_cast<size_t>(wrapped(x, mWidth, mWrap));
    }

    int mWidth, mHeight;
    ImageWrap mWrap;
    double mPixel; ///< Edge of a pixel, world units.
    std::vector<float> mCoefficients;
    Interval mRange;
};

/// Returns the weights of the channels.
std::vector<float> weightsOf(const Image& image, std::string_view channel) {
    const auto find = [&](std::string_view name) {
        return static_cast<size_t>(std::find(image.channels.begin(), image.channels.end(), name) -
                                   image.channels.begin());
    };
    std::vector<float> weights(image.channels.size());
    if (!channel.empty()) {
        if (find(channel) == weights.size())
            throw ValueError(fmt::format("the picture has no channel '{}'; its channels are {}", channel,
                                         fmt::join(image.channels, ", ")));
        weights[find(channel)] = 1;
    } else if (weights.size() == 1) {
        weights[0] = 1;
    } else {
        constexpr std::array<std::pair<const char*, float>, 3> kLuminance{
            {{"R", 0.2126f}, {"G", 0.7152f}, {"B", 0.0722f}}};
        for (const auto& [name, weight] : kLuminance) {
            if (find(name) == weights.size())
                throw ValueError(
                    fmt::format("the picture has no luminance, since its channels are {}; choose one with "
                                "channel=",
                                fmt::join(image.channels, ", ")));
            weights[find(name)] = weight;
        }
    }
    return weights;
}

} // namespace

ScalarFieldN<2> imageField(const Image& image, std::string_view channel, ImageWrap wrap) {
    checkImage(image);
    const std::vector<float> weights = weightsOf(image, channel);
    std::vector<float> values(static_cast<size_t>(image.width) * static_cast<size_t>(image.height));
    size_t bad = 0;
    for (size_t k = 0; k < values.size(); ++k) {
        for (size_t c = 0; c < weights.size(); ++c)
            if (weights[c] != 0) values[k] += weights[c] * image.pixels[k * weights.size() + c];
        bad += !std::isfinite(values[k]);
    }
    if (bad > 0)
        throw ValueError(
            fmt::format("{} of {} pixels are not finite (NaN or infinite); give them a value", bad, values.size()));
    return ScalarFieldN<2>(ImageSpline(image.width, image.height, values, wrap));
}

} // namespace curlew
