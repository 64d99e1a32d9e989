// SPDX-License-Identifier: Apache-2.0
#include "curlew/render/WallOutline.h"

#include "curlew/base/Parallel.h"
#include "curlew/picture/Display.h"
#include "curlew/picture/Exposure.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>
#include <vector>

namespace curlew {

namespace {

constexpr int kMaxOutlineSteps = 2000;

/// The state of a ray that marches through the box.
struct OutlineRay {
    Vec3d direction;
    double at = 0, end = 0;   ///< World units from the eye.
    double unitsPerPixel = 0; ///< At distance 1.
    float before = 0;         ///< The previous distance from the wall; 0: none yet.
    double glow = 0;
    int passages = 0;
    double nearest = std::numeric_limits<double>::infinity(); ///< Minimum distance to the wall, pixels.
};

/// Sets the ray's interval in the box. If the ray misses the box, the interval is empty: end <= begin.
void enter(OutlineRay& ray, const Vec3d& eye, const Box& box) {
    double begin = 0, end = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
        const double a = (box.lower[axis] - eye[axis]) / ray.direction[axis],
                     b = (box.upper[axis] - eye[axis]) / ray.direction[axis];
        begin = std::max(begin, std::min(a, b));
        end = std::min(end, std::max(a, b));
    }
    ray.at = begin;
    ray.end = end;
}

/// Ends a ray that enters a solid wall.
void step(OutlineRay& ray, float distance, const Vec3d& gradient, double lipschitz, bool solid) {
    const double size = std::abs(static_cast<double>(distance)), pixel = ray.unitsPerPixel * ray.at;
    ray.nearest = std::min(ray.nearest, size / pixel);
    if (ray.before != 0 && (distance < 0) != (ray.before < 0)) {
        const double facing = std::abs(dot(gradient, ray.direction)) / std::max(length(gradient), 1e-12);
        const double rim = std::max(1 - facing, 0.0);
        ray.glow += (ray.passages++ == 0 ? 1 : 0.4) * rim * rim * rim;
        if (solid && distance < 0) ray.end = ray.at;
    }
    ray.before = distance;
    ray.at += std::max(size / std::max(lipschitz, 1.0), 0.5 * pixel);
}

/// Steps all rays until each has left the box.
void march(std::span<OutlineRay> rays, const Wall& wall, const Vec3d& eye, const Monitor& monitor) {
    for (int k = 0; k < kMaxOutlineSteps; ++k) {
        monitor.check();
        PointBatch points;
        std::array<size_t, kBatch> of{};
        for (size_t r = 0; r < rays.size(); ++r)
            if (rays[r].at < rays[r].end) {
                of[static_cast<size_t>(points.size)] = r;
                points.push(eye + rays[r].direction * rays[r].at);
            }
        if (points.size == 0) return;
        JetBatch<float, 1> jets;
        wall.sdf.distance.eval(points, jets);
        for (int i = 0; i < points.size; ++i) {
            const auto jet = jets[i];
            step(rays[of[static_cast<size_t>(i)]], jet.value,
                 {{static_cast<double>(jet.gradient[0]), static_cast<double>(jet.gradient[1]),
                   static_cast<double>(jet.gradient[2])}},
                 wall.sdf.lipschitz, wall.side == Side::outside);
        }
    }
}

float outlineOf(const OutlineRay& ray) {
    if (ray.passages > 0) return static_cast<float>(-std::expm1(-ray.glow));
    return static_cast<float>(-std::expm1(-1.0) * std::exp(-ray.nearest * ray.nearest / 2));
}

/// The outline of a wall as a camera sees it.
class Outliner {
  public:
    Outliner(const Domain& domain, const Camera& camera)
        : mWall(*domain.wall),
          mCamera(camera),
          mBox(domain.box.padded(0.02 * length(domain.box.size()))) {} // the wall may touch the box

    /// Returns the brightness at `count` places in pixels; place(k) returns x and y.
    template <class Place>
    std::vector<float> at(size_t count, const Place& place, const Monitor& monitor) const {
        std::vector<float> found(count);
        parallelFor(
            count, kBatch,
            [&](size_t begin, size_t end) {
                std::array<OutlineRay, kBatch> rays;
                for (size_t k = begin; k < end; ++k) rays[k - begin] = rayTo(place(k));
                march(std::span(rays).first(end - begin), mWall, mCamera.eye(), monitor);
                for (size_t k = begin; k < end; ++k) found[k] = outlineOf(rays[k - begin]);
            },
            monitor);
        return found;
    }

  private:
    OutlineRay rayTo(const Vec<double, 2>& place) const {
        OutlineRay ray{.direction = mCamera.direction(place[0], place[1])};
        ray.unitsPerPixel = dot(ray.direction, mCamera.forward()) / mCamera.focal();
        enter(ray, mCamera.eye(), mBox);
        return ray;
    }

    const Wall& mWall;
    const Camera& mCamera;
    Box mBox;
};

/// An image of half the width and height, whose pixel (x, y) shows the place (2 x + 1, 2 y + 1) of the whole one.
struct HalfImage {
    int width, height;
    std::vector<float> values;

    /// The pixels between which the centre of a whole pixel is, on one axis, and which part of the way.
    struct Between {
        int lower, upper;
        float part;
    };
    static Between between(int k, int size) {
        const double at = std::clamp(0.5 * k - 0.25, 0.0, size - 1.0);
        const int lower = std::min(static_cast<int>(at), std::max(size - 2, 0));
        return {lower, std::min(lower + 1, size - 1), static_cast<float>(at - lower)};
    }
    float at(int x, int y) const {
        return values[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
    }
    /// Returns the interpolated value at the centre of a whole pixel; nullopt if there is an edge.
    std::optional<float> smoothAt(int x, int y) const {
        constexpr float kEdge = 0.03f; // more of a difference between neighbours shows as a step
        const Between across = between(x, width), down = between(y, height);
        const std::array<float, 4> v{at(across.lower, down.lower), at(across.upper, down.lower),
                                     at(across.lower, down.upper), at(across.upper, down.upper)};
        const auto [least, most] = std::minmax_element(v.begin(), v.end());
        if (*most - *least > kEdge) return {};
        return std::lerp(std::lerp(v[0], v[1], across.part), std::lerp(v[2], v[3], across.part), down.part);
    }
};

} // namespace

Image wallOutline(const Domain& domain, const Camera& camera, const Monitor& monitor) {
    constexpr int kFine = 2; // samples along a pixel at an edge
    if (!domain.wall) throw ValueError("there is no wall to outline");
    if (!domain.box.finite()) throw ValueError("the wall's domain is infinite; give it a box");
    const Outliner outliner(domain, camera);
    const auto placeOf = [](size_t k, int width) {
        const size_t column = k % static_cast<size_t>(width), row = k / static_cast<size_t>(width);
        return Vec<double, 2>{{static_cast<double>(column), static_cast<double>(row)}};
    };
    HalfImage half{.width = (camera.width() + 1) / 2, .height = (camera.height() + 1) / 2, .values = {}};
    half.values = outliner.at(
        static_cast<size_t>(half.width) * static_cast<size_t>(half.height),
        [&](size_t k) {
            return placeOf(k, half.width) * 2.0 + Vec<double, 2>{{1, 1}};
        },
        monitor);
    Image image = filledImage(camera.width(), camera.height(), {"outline"});
    std::vector<size_t> edges;
    for (size_t k = 0; k < image.pixels.size(); ++k) {
        const Vec<double, 2> pixel = placeOf(k, image.width);
        if (const auto value = half.smoothAt(static_cast<int>(pixel[0]), static_cast<int>(pixel[1])))
            image.pixels[k] = *value;
        else
            edges.push_back(k);
    }
    constexpr size_t kSamples = size_t{kFine} * kFine;
    const std::vector<float> fine = outliner.at(
        edges.size() * kSamples,
        [&](size_t k) {
            const Vec<double, 2> inPixel = placeOf(k % kSamples, kFine) + Vec<double, 2>{{0.5, 0.5}};
            return placeOf(edges[k / kSamples], image.width) + inPixel * (1.0 / kFine);
        },
        monitor);
    for (size_t n = 0; n < edges.size(); ++n) {
        const float* const samples = &fine[n * kSamples];
        image.pixels[edges[n]] = std::accumulate(samples, samples + kSamples, 0.0f) / static_cast<float>(kSamples);
    }
    return image;
}

Image withWallOutline(Image picture, const Domain& domain, const Camera& camera, double brightness,
                      const Monitor& monitor) {
    constexpr Vec3f kGlass{{0.45f, 0.62f, 0.85f}};
    const Image outline = wallOutline(domain, camera, monitor);
    Image light = plainPicture(outline.width, outline.height, kGlass);
    for (size_t k = 0; k < light.pixels.size(); ++k) light.pixels[k] *= outline.pixels[k / 3];
    return developed(light, brightness, std::move(picture));
}

} // namespace curlew
