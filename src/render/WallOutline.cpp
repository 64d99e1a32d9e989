// SPDX-License-Identifier: Apache-2.0
#include "curlew/render/WallOutline.h"

#include "curlew/base/Parallel.h"
#include "curlew/picture/Display.h"
#include "curlew/picture/Exposure.h"

#include <algorithm>
#include <cmath>
#include <span>

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

/// Enlarges an image to twice the size, or one pixel less, by linear interpolation between pixel centres.
Image enlarged(const Image& small, int width, int height) {
    Image large = filledImage(width, height, small.channels);
    const auto between = [](int k, int size) {
        const double at = std::clamp(0.5 * k - 0.25, 0.0, size - 1.0);
        const int lower = std::min(static_cast<int>(at), std::max(size - 2, 0));
        return std::tuple(lower, std::min(lower + 1, size - 1), static_cast<float>(at - lower));
    };
    for (int y = 0; y < height; ++y) {
        const auto [top, bottom, down] = between(y, small.height);
        for (int x = 0; x < width; ++x) {
            const auto [left, right, across] = between(x, small.width);
            large.at(x, y) = std::lerp(std::lerp(small.at(left, top), small.at(right, top), across),
                                       std::lerp(small.at(left, bottom), small.at(right, bottom), across), down);
        }
    }
    return large;
}

} // namespace

Image wallOutline(const Domain& domain, const Camera& camera, const Monitor& monitor) {
    if (!domain.wall) throw ValueError("there is no wall to outline");
    if (!domain.box.finite()) throw ValueError("the wall's domain is infinite; give it a box");
    const int width = (camera.width() + 1) / 2, height = (camera.height() + 1) / 2;
    Image small = filledImage(width, height, {"outline"});
    const double focal = camera.focal();
    const Box box = domain.box.padded(0.02 * length(domain.box.size())); // the wall may touch the box
    parallelFor(
        small.pixels.size(), kBatch,
        [&](size_t begin, size_t end) {
            std::array<OutlineRay, kBatch> rays;
            for (size_t k = begin; k < end; ++k) {
                OutlineRay& ray = rays[k - begin];
                const size_t column = k % static_cast<size_t>(width), row = k / static_cast<size_t>(width);
                const auto x = static_cast<double>(column), y = static_cast<double>(row);
                ray = {.direction = camera.direction(2 * x + 1, 2 * y + 1)};
                ray.unitsPerPixel = dot(ray.direction, camera.forward()) / focal;
                enter(ray, camera.eye(), box);
            }
            march(std::span(rays).first(end - begin), *domain.wall, camera.eye(), monitor);
            for (size_t k = begin; k < end; ++k) small.pixels[k] = outlineOf(rays[k - begin]);
        },
        monitor);
    return enlarged(small, camera.width(), camera.height());
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
