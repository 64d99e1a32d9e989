// SPDX-License-Identifier: Apache-2.0
#include "curlew/picture/Lic.h"

#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"
#include "curlew/base/Random.h"
#include "curlew/base/Require.h"
#include "curlew/math/Vec.h"

#include <algorithm>
#include <numbers>

namespace curlew {

namespace {

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

/// Interpolates an image bilinearly between its pixel centres.
class Sampler {
  public:
    explicit Sampler(const Image& image) : mImage(image) {}

    bool contains(double x, double y) const { return x >= 0 && y >= 0 && x <= mImage.width && y <= mImage.height; }

    float at(double x, double y, int channel) const {
        const double px = std::clamp(x - 0.5, 0.0, mImage.width - 1.0),
                     py = std::clamp(y - 0.5, 0.0, mImage.height - 1.0);
        const int i = static_cast<int>(px), j = static_cast<int>(py);
        const auto u = static_cast<float>(px - i), v = static_cast<float>(py - j);
        // A neighbour without weight does not count, even if it is NaN.
        const int right = u > 0 ? std::min(i + 1, mImage.width - 1) : i;
        const int down = v > 0 ? std::min(j + 1, mImage.height - 1) : j;
        const float upper = mImage.at(i, j, channel) * (1 - u) + mImage.at(right, j, channel) * u;
        const float lower = mImage.at(i, down, channel) * (1 - u) + mImage.at(right, down, channel) * u;
        return upper * (1 - v) + lower * v;
    }

  private:
    const Image& mImage;
};

/// Returns white noise, one value per grain.
Image whiteNoise(int width, int height, const LicOptions& o) {
    Image noise = filledImage(static_cast<int>(std::ceil(width / o.grain)) + 1,
                              static_cast<int>(std::ceil(height / o.grain)) + 1, {"noise"});
    for (int y = 0; y < noise.height; ++y)
        for (int x = 0; x < noise.width; ++x)
            noise.at(x, y) = static_cast<float>(
                // independent of the image size
                randomUniform(o.seed, static_cast<uint64_t>(x), static_cast<uint64_t>(y)));
    return noise;
}

/// Averages the noise along the streamline through a pixel.
class Streak {
  public:
    Streak(const Sampler& vectors, const Sampler& noise, const LicOptions& o)
        : mVectors(vectors), mNoise(noise), mOptions(o), mSteps(o.steps()) {}

    float at(double x, double y) const {
        double sum = grain(x, y), weight = 1;
        for (const double step : {LicOptions::kStep, -LicOptions::kStep}) {
            double px = x, py = y;
            for (int k = 1; k <= mSteps && advance(step, px, py); ++k) {
                const double w = weightOf(k);
                sum += w * grain(px, py);
                weight += w;
            }
        }
        return static_cast<float>(sum / weight);
    }

  private:
    double grain(double x, double y) const {
        return static_cast<double>(mNoise.at(x / mOptions.grain + 0.5, y / mOptions.grain + 0.5, 0));
    }
    double weightOf(int k) const {
        if (mOptions.kernel == LicKernel::box) return 1;
        return 0.5 * (1 + std::cos(std::numbers::pi * k / (mSteps + 1)));
    }
    /// Computes the unit vector at a position, with its second component downwards. Returns false if there is none.
    bool direction(double x, double y, double& dx, double& dy) const {
        if (!mVectors.contains(x, y)) return false;
        dx = static_cast<double>(mVectors.at(x, y, 0));
        dy = -static_cast<double>(mVectors.at(x, y, 1));
        const double size = length(Vec<double, 2>{{dx, dy}});
        if (!(size > 0) || !std::isfinite(size)) return false; // zero or NaN
        dx /= size;
        dy /= size;
        return true;
    }
    bool advance(double step, double& x, double& y) const {
        double dx = 0, dy = 0;
        if (!direction(x, y, dx, dy) || !direction(x + 0.5 * step * dx, y + 0.5 * step * dy, dx, dy)) return false;
        x += step * dx;
        y += step * dy;
        return mVectors.contains(x, y);
    }

    const Sampler& mVectors;
    const Sampler& mNoise;
    const LicOptions& mOptions;
    int mSteps;
};

struct Moments {
    double count = 0, sum = 0, squares = 0;
    Moments& operator+=(const Moments& o) {
        count += o.count;
        sum += o.sum;
        squares += o.squares;
        return *this;
    }
};

void stretch(Image& image, double contrast) {
    const Moments m = parallelSum(image.pixels.size(), 1 << 14, [&](size_t begin, size_t end) {
        Moments part;
        for (size_t k = begin; k < end; ++k)
            if (const auto value = static_cast<double>(image.pixels[k]); !std::isnan(value))
                part += {1, value, value * value};
        return part;
    });
    const double mean = m.sum / std::max(m.count, 1.0);
    const double deviation = std::sqrt(std::max(m.squares / std::max(m.count, 1.0) - mean * mean, 0.0));
    if (!(deviation > 0)) return;
    for (float& value : image.pixels)
        if (!std::isnan(value))
            value = static_cast<float>(
                std::clamp(0.5 + (static_cast<double>(value) - mean) * (contrast / deviation), 0.0, 1.0));
}

} // namespace

int LicOptions::steps() const {
    constexpr double kMost = 1e6; // far longer than any picture is wide
    return static_cast<int>(std::clamp(length / 2 / kStep, 1.0, kMost));
}

Image convolved(const Image& vectors, const Image& noise, const LicOptions& o, const Monitor& monitor) {
    const Sampler vectorAt(vectors), noiseAt(noise);
    const Streak streak(vectorAt, noiseAt, o);
    Image image = filledImage(vectors.width, vectors.height, {"lic"});
    parallelFor(
        static_cast<size_t>(image.height), 4,
        [&](size_t begin, size_t end) {
            for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y)
                for (int x = 0; x < image.width; ++x)
                    image.at(x, y) =
                        std::isnan(vectors.at(x, y, 0) + vectors.at(x, y, 1)) ? kNothing : streak.at(x + 0.5, y + 0.5);
        },
        monitor);
    return image;
}

Image lic(const Image& vectors, const LicOptions& o, const Monitor& monitor, const LicConvolution& convolution) {
    checkImage(vectors);
    if (vectors.channels.size() != 2) throw ValueError("a line integral convolution needs vectors with two channels");
    requirePositive(o.length, "the streak length");
    requirePositive(o.grain, "the grain of the noise");
    requirePositive(o.contrast, "the contrast");
    requireMemory(static_cast<double>(vectors.width) * vectors.height * (1 + 1 / (o.grain * o.grain)) * sizeof(float),
                  fmt::format("a picture of {} x {} pixels", vectors.width, vectors.height), "choose a smaller width");
    Image image = convolution(vectors, whiteNoise(vectors.width, vectors.height, o), o, monitor);
    stretch(image, o.contrast);
    return image;
}

Image litBy(const Image& lic, Image picture) {
    checkImage(lic);
    checkImage(picture);
    if (lic.channels.size() != 1 || lic.width != picture.width || lic.height != picture.height)
        throw ValueError("the light must have one channel and the size of the picture");
    constexpr float kDark = 0.3f, kBright = 1.3f;
    const size_t count = picture.channels.size();
    for (size_t k = 0; k < lic.pixels.size(); ++k)
        if (!std::isnan(lic.pixels[k]))
            for (size_t c = 0; c < count; ++c)
                picture.pixels[k * count + c] *= std::lerp(kDark, kBright, lic.pixels[k]);
    return picture;
}

} // namespace curlew
