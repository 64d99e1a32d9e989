// SPDX-License-Identifier: Apache-2.0
#include "curlew/render/SurfaceShading.h"

#include "curlew/base/Parallel.h"
#include "curlew/base/Random.h"
#include "curlew/picture/Display.h"

#include <fmt/format.h>

#include <numbers>

namespace curlew {

namespace {

const std::vector<std::string> kChannels{"R", "G", "B", "A", "Z"};
constexpr float kNowhere = std::numeric_limits<float>::infinity();
constexpr double kLightRadius = 0.03; // radians

Vec3d linearOf(const Vec3f& display) {
    Vec3d linear;
    for (int i = 0; i < 3; ++i) linear[i] = linearFromDisplay(static_cast<double>(display[i]));
    return linear;
}

double powerOf48(double x) {
    double power = x * x * x; // 3, then 6, 12, 24, 48
    for (int k = 0; k < 4; ++k) power *= power;
    return power;
}

Vec3d times(const Vec3d& a, const Vec3d& b) { return {{a[0] * b[0], a[1] * b[1], a[2] * b[2]}}; }

/// The lights, in linear R, G, B per unit of albedo.
class Lights {
  public:
    Lights(const Camera& camera, const SurfaceLook& look)
        : mEye(camera.eye()), mUp(camera.up()), mGloss(look.gloss), mFinish(look.finish) {
        mKey = normalized(
            length(look.light) > 0 ? look.light : camera.up() * 0.75 - camera.right() * 0.55 - camera.forward() * 0.65);
        const Vec3d helper = std::abs(mKey[0]) < 0.6 ? Vec3d{{1, 0, 0}} : Vec3d{{0, 1, 0}};
        mAcross = normalized(cross(mKey, helper));
        mAlong = cross(mKey, mAcross);
        mStrip = camera.right() * 0.8 + camera.up() * 0.1 - camera.forward() * 0.25;
    }

    const Vec3d& key() const { return mKey; }

    /// Returns the direction to one of `count` samples of the key light's disc. Samples have equal areas; their
    /// direction from the disc's centre is random.
    Vec3d toKey(size_t place, size_t count, double random) const {
        const double part = (static_cast<double>(place) + 0.5) / static_cast<double>(count);
        const double r = kLightRadius * std::sqrt(part), phi = 2 * std::numbers::pi * random;
        return normalized(mKey + mAcross * (r * std::cos(phi)) + mAlong * (r * std::sin(phi)));
    }

    /// Returns the light from a surface sample to the eye.
    Vec3d at(const SurfaceSample& sample, const Vec3d& albedo, bool inShadow) const {
        const Vec3d n{{static_cast<double>(sample.normal[0]), static_cast<double>(sample.normal[1]),
                       static_cast<double>(sample.normal[2])}};
        const Vec3d toEye = normalized(mEye - sample.position);
        const double facing = std::clamp(dot(n, toEye), 0.0, 1.0), away = 1 - facing;
        if (mFinish == Finish::outline) return albedo * (0.03 + 0.9 * away * away * away);
        if (mFinish == Finish::mirror) {
            Vec3d light = times(albedo, studio(n * (2 * facing) - toEye));
            // saturates, because a film reflects all light at grazing angles
            for (double& part : light.c) part = 1 - std::exp(-part);
            return light;
        }
        const double key = inShadow ? 0 : std::max(dot(n, mKey), 0.0);
        const double sky = 0.5 + 0.5 * dot(n, mUp), rim = away * away * away * away * (0.25 + 0.75 * sky);
        const Vec3d diffuse = Vec3d{{1.05, 1.0, 0.92}} * (0.95 * key) + Vec3d{{0.82, 0.92, 1.08}} * (0.30 * sky) +
                              Vec3d{{1.05, 0.98, 0.9}} * (0.09 * (1 - sky)) + Vec3d{{1, 1, 1}} * (0.10 * facing);
        const double shine = key > 0 ? mGloss * powerOf48(std::max(dot(n, normalized(mKey + toEye)), 0.0)) : 0;
        return times(albedo, diffuse) + Vec3d{{1, 1, 1}} * (shine + 1.4 * mGloss * rim);
    }

  private:
    /// Returns what a mirror sees in a direction: a window at the key light, a strip of light opposite, and a room.
    Vec3d studio(const Vec3d& direction) const {
        const auto box = [&](const Vec3d& to, double width, double height, double bar) {
            const double ahead = dot(direction, to);
            if (!(ahead > 0)) return 0.0;
            const double u = std::abs(dot(direction, cross(mUp, to))) / ahead,
                         v = std::abs(dot(direction, mUp) - ahead * dot(to, mUp)) / ahead;
            const auto within = [](double edge, double x) { return std::clamp((edge - x) / 0.06, 0.0, 1.0); };
            return within(width, u) * within(height, v) * (bar > 0 ? 1 - within(bar, std::min(u, v)) : 1);
        };
        const double sky = 0.5 + 0.5 * dot(direction, mUp);
        const Vec3d strip = normalized(mStrip);
        return Vec3d{{1.0, 0.98, 0.94}} * (12 * box(mKey, 0.42, 0.42, 0.02) + 7 * box(strip, 0.18, 1.1, 0)) +
               Vec3d{{0.9, 0.97, 1.06}} * (0.6 + 1.8 * sky * sky);
    }

    Vec3d mEye, mUp, mKey, mAcross, mAlong, mStrip;
    double mGloss;
    Finish mFinish;
};

/// Returns whether something is between the hits of a row of pixels and the light.
std::vector<bool> shadowed(const SurfaceView& view, const Lights& lights, const Surface& surface, int y) {
    const auto width = static_cast<size_t>(view.camera.width());
    const size_t row = static_cast<size_t>(y - view.rows.begin) * width, begin = view.first[row];
    const size_t samples = view.samplesPerPixel();
    const double offset = surface.rayOffset() + 2 * view.resolution;
    std::vector<Ray> rays;
    std::vector<size_t> of;
    for (size_t x = 0; x < width; ++x)
        for (size_t k = view.first[row + x]; k < view.first[row + x + 1]; ++k) {
            const SurfaceSample& sample = view.hits[k];
            Vec3d n;
            for (int axis = 0; axis < 3; ++axis) n[axis] = static_cast<double>(sample.normal[axis]);
            if (!(dot(n, lights.key()) > 0)) continue; // it faces away from the light
            const size_t place = k - view.first[row + x], pixel = static_cast<size_t>(y) * width + x;
            rays.push_back({sample.position + n * (offset + static_cast<double>(sample.lift)),
                            lights.toKey(place, samples, randomUniform(1, pixel * samples + place))});
            of.push_back(k - begin);
        }
    std::vector<uint8_t> dark(rays.size());
    surface.occluded(rays, view.resolution, dark);
    std::vector<bool> result(view.first[row + width] - begin);
    for (size_t i = 0; i < of.size(); ++i) result[of[i]] = dark[i] != 0;
    return result;
}

/// The light of a pixel, its coverage, and its depth.
struct Pixel {
    Vec3d light;
    double cover = 0;
    float depth = kNowhere;
};

Vec3f backgroundAt(const SurfaceLook& look, const Camera& camera, int x, int y) {
    const double u = (x + 0.5) / camera.width() - 0.5, v = (y + 0.5) / camera.height() - 0.45;
    Vec3f display = look.background * static_cast<float>(1.06 - 0.6 * (u * u + v * v));
    // Random dither of half an 8-bit level, to avoid banding.
    const auto pixel = static_cast<uint64_t>(y) * static_cast<uint64_t>(camera.width()) + static_cast<uint64_t>(x);
    for (float& part : display.c) part += static_cast<float>((randomUniform(0, pixel) - 0.5) / 255);
    return display;
}

void checkPicture(const Image& picture, const Camera& camera) {
    checkImage(picture);
    if (picture.channels != kChannels) throw ValueError("the background picture needs the channels R, G, B, A and Z");
    if (picture.width != camera.width() || picture.height != camera.height())
        throw ValueError(fmt::format("the background picture has {} x {} pixels, but the camera has {} x {}",
                                     picture.width, picture.height, camera.width(), camera.height()));
}

Pixel pixelOf(const Image& image, int x, int y) {
    Vec3f display;
    for (int i = 0; i < 3; ++i) display[i] = image.at(x, y, i);
    return {linearOf(display), static_cast<double>(image.at(x, y, 3)), image.at(x, y, 4)};
}

void setPixel(Image& image, int x, int y, const Pixel& pixel) {
    for (int i = 0; i < 3; ++i)
        image.at(x, y, i) = static_cast<float>(displayFromLinear(std::max(pixel.light[i], 0.0)));
    image.at(x, y, 3) = static_cast<float>(std::clamp(pixel.cover, 0.0, 1.0));
    image.at(x, y, 4) = pixel.depth;
}

void setEmpty(Image& image, int x, int y, const Vec3f& display) {
    for (int i = 0; i < 3; ++i) image.at(x, y, i) = std::max(display[i], 0.0f);
    image.at(x, y, 3) = 0;
    image.at(x, y, 4) = kNowhere;
}

/// Merges samples into a pixel. Samples in front of its content cover it. Samples behind are seen through its uncovered
/// part, instead of the background.
struct Samples {
    Vec3d before{}, after{};
    double nearer = 0, farther = 0; ///< Their fractions of the pixel's samples.
    float depth = kNowhere;

    void add(const Vec3d& light, float sampleDepth, const Pixel& there, double weight) {
        const bool near = sampleDepth < there.depth;
        (near ? before : after) += light * weight;
        (near ? nearer : farther) += weight;
        depth = std::min(depth, sampleDepth);
    }
    Pixel over(const Pixel& there, const Vec3d& background) const {
        const double through = 1 - there.cover;
        return {.light = there.light * (1 - nearer) + before + (after - background * farther) * through,
                .cover = nearer + there.cover * (1 - nearer) + farther * through,
                .depth = std::min(depth, there.depth)};
    }
};

} // namespace

Image backgroundPicture(const Camera& camera, const SurfaceLook& look, const Monitor& monitor) {
    Image image = filledImage(camera.width(), camera.height(), kChannels);
    parallelFor(
        static_cast<size_t>(camera.height()), 1,
        [&](size_t y, size_t) {
            for (int x = 0; x < camera.width(); ++x)
                setEmpty(image, x, static_cast<int>(y), backgroundAt(look, camera, x, static_cast<int>(y)));
        },
        monitor);
    return image;
}

void shadeOnto(Image& picture, const SurfaceView& view, const std::vector<Vec3f>& colors, const SurfaceLook& look,
               const Surface* shadows, const Monitor& monitor) {
    if (colors.size() != 1 && colors.size() != view.hits.size())
        throw ValueError(
            fmt::format("{} colours for {} hits; give one, or one for each", colors.size(), view.hits.size()));
    const Camera& camera = view.camera;
    checkPicture(picture, camera);
    const Lights lights(camera, look);
    const bool hides = look.finish == Finish::matt;
    const double weight = 1 / static_cast<double>(view.samplesPerPixel());
    const Vec3d albedo = linearOf(colors.empty() ? Vec3f{} : colors.front());
    const auto shadeRow = [&](int y) {
        const size_t row = static_cast<size_t>(y - view.rows.begin) * static_cast<size_t>(camera.width());
        const size_t begin = view.first[row], end = view.first[row + static_cast<size_t>(camera.width())];
        const std::vector<bool> dark =
            shadows && hides ? shadowed(view, lights, *shadows, y) : std::vector<bool>(end - begin);
        for (int x = 0; x < camera.width(); ++x) {
            const size_t pixel = row + static_cast<size_t>(x);
            if (view.first[pixel] == view.first[pixel + 1]) continue;
            const Pixel there = pixelOf(picture, x, y);
            Samples samples;
            Pixel added = there;
            for (size_t k = view.first[pixel]; k < view.first[pixel + 1]; ++k) {
                const Vec3d light =
                    lights.at(view.hits[k], colors.size() == 1 ? albedo : linearOf(colors[k]), dark[k - begin]);
                if (hides)
                    samples.add(light, view.hits[k].depth, there, weight);
                else if (view.hits[k].depth < there.depth)
                    added.light += light * weight;
            }
            setPixel(picture, x, y, hides ? samples.over(there, linearOf(backgroundAt(look, camera, x, y))) : added);
        }
    };
    parallelFor(
        static_cast<size_t>(view.rows.end - view.rows.begin), 1,
        [&](size_t k, size_t) { shadeRow(view.rows.begin + static_cast<int>(k)); }, monitor);
}

Image shadeSurface(const SurfaceView& view, const std::vector<Vec3f>& colors, const SurfaceLook& look,
                   const Surface* shadows, const Image* behind, const Monitor& monitor) {
    Image picture = behind ? *behind : backgroundPicture(view.camera, look, monitor.quiet());
    shadeOnto(picture, view, colors, look, shadows, monitor);
    return picture;
}

} // namespace curlew
