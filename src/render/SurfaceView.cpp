// SPDX-License-Identifier: Apache-2.0
#include "curlew/render/SurfaceView.h"

#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"
#include "curlew/math/Interval.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace curlew {

namespace {

struct RowOfHits {
    std::vector<SurfaceSample> hits;
    std::vector<size_t> counts; ///< By pixel.
};

SurfaceSample sampleOf(const Ray& ray, const RayHit& hit, const Camera& camera) {
    SurfaceSample sample{.position = ray.origin + ray.direction * hit.distance, .normal = {}};
    for (int axis = 0; axis < 3; ++axis) sample.normal[axis] = static_cast<float>(hit.normal[axis]);
    sample.lift = static_cast<float>(hit.lift);
    sample.depth = static_cast<float>(dot(sample.position - camera.eye(), camera.forward()));
    return sample;
}

/// Pixels: columns left … right - 1 and rows top … bottom - 1.
struct PixelRange {
    int left, right, top, bottom;
};

/// Returns the pixels in which a box can be visible.
PixelRange rangeOf(const Box& box, const Camera& camera) {
    const PixelRange all{0, camera.width(), 0, camera.height()};
    Interval x{HUGE_VAL, -HUGE_VAL}, y = x;
    for (int corner = 0; corner < 8; ++corner) {
        Vec3d p;
        for (int axis = 0; axis < 3; ++axis) p[axis] = ((corner >> axis) & 1 ? box.upper : box.lower)[axis];
        const auto at = camera.project(p);
        if (!(at.depth > 1e-6 * length(p - camera.eye()))) return all; // beside or behind the eye
        x = {std::min(x.lower, at.x), std::max(x.upper, at.x)};
        y = {std::min(y.lower, at.y), std::max(y.upper, at.y)};
    }
    const auto pixel = [](double position, int size) {
        return static_cast<int>(std::clamp(position, 0.0, static_cast<double>(size)));
    };
    return {pixel(x.lower - 1, all.right), pixel(x.upper + 2, all.right), pixel(y.lower - 1, all.bottom),
            pixel(y.upper + 2, all.bottom)};
}

RowOfHits viewRow(const Surface& surface, const Camera& camera, int samples, int y, double resolution) {
    const PixelRange range = rangeOf(surface.box(), camera);
    RowOfHits row;
    row.counts.assign(static_cast<size_t>(camera.width()), 0);
    if (y < range.top || y >= range.bottom || range.left >= range.right) return row;
    std::vector<Ray> rays;
    const int squared = samples * samples;
    const auto perPixel = static_cast<size_t>(squared);
    rays.reserve(static_cast<size_t>(range.right - range.left) * perPixel);
    for (int x = range.left; x < range.right; ++x)
        for (int j = 0; j < samples; ++j)
            for (int i = 0; i < samples; ++i)
                rays.push_back({camera.eye(), camera.direction(x + (i + 0.5) / samples, y + (j + 0.5) / samples)});
    std::vector<RayHit> found(rays.size());
    surface.intersect(rays, resolution, found);
    for (size_t begin = 0; begin < rays.size(); begin += perPixel) {
        const size_t before = row.hits.size();
        for (size_t k = begin; k < begin + perPixel; ++k) {
            if (!found[k].found()) continue;
            row.hits.push_back(sampleOf(rays[k], found[k], camera));
        }
        row.counts[static_cast<size_t>(range.left) + begin / perPixel] = row.hits.size() - before;
    }
    return row;
}

} // namespace

double resolutionOf(const Surface& surface, const Camera& camera) {
    const Box& box = surface.box();
    const double depth = dot(box.center() - camera.eye(), camera.forward());
    const double pixel = 1 / camera.focal(); // at depth 1
    return 0.25 * pixel * std::max(depth, 0.1 * length(box.size()));
}

double SurfaceView::coverage() const {
    return static_cast<double>(hits.size()) / static_cast<double>((first.size() - 1) * samplesPerPixel());
}

SurfaceView viewThrough(const Surface& surface, const SurfaceView& view, const Monitor& monitor) {
    const Camera& camera = view.camera;
    const double offset = surface.rayOffset() + 2 * view.resolution;
    std::vector<SurfaceSample> next(view.hits.size());
    std::vector<uint8_t> found(view.hits.size());
    parallelFor(
        next.size(), 1024,
        [&](size_t begin, size_t end) {
            std::vector<Ray> rays;
            for (size_t k = begin; k < end; ++k) {
                const Vec3d fromEye = view.hits[k].position - camera.eye(), direction = fromEye * (1 / length(fromEye));
                rays.push_back({view.hits[k].position + direction * offset, direction});
            }
            std::vector<RayHit> hits(rays.size());
            surface.intersect(rays, view.resolution, hits);
            for (size_t k = begin; k < end; ++k) {
                found[k] = hits[k - begin].found();
                if (found[k]) next[k] = sampleOf(rays[k - begin], hits[k - begin], camera);
            }
        },
        monitor);
    SurfaceView through{.camera = camera,
                        .samples = view.samples,
                        .resolution = view.resolution,
                        .rows = view.rows,
                        .hits = {},
                        .first = {0}};
    for (size_t pixel = 0; pixel + 1 < view.first.size(); ++pixel) {
        for (size_t k = view.first[pixel]; k < view.first[pixel + 1]; ++k)
            if (found[k]) through.hits.push_back(next[k]);
        through.first.push_back(through.hits.size());
    }
    return through;
}

namespace {

constexpr int kAcross = 128; ///< Rays of visiblePoints along the longer edge of the picture.

/// Returns the distance between these rays, in pixels.
double coarseStep(const Camera& camera) {
    return std::max(camera.width(), camera.height()) / static_cast<double>(kAcross);
}

/// Returns the approximate number of pixels that show the surface.
double pixelsOf(const Surface& surface, const Camera& camera) {
    const double step = coarseStep(camera);
    return static_cast<double>(visiblePoints(surface, camera).size()) * step * step;
}

} // namespace

std::vector<Vec3d> visiblePoints(const Surface& surface, const Camera& camera) {
    const double step = coarseStep(camera);
    std::vector<Ray> rays;
    for (int j = 0; j < kAcross && (j + 0.5) * step < camera.height(); ++j)
        for (int i = 0; i < kAcross && (i + 0.5) * step < camera.width(); ++i)
            rays.push_back({camera.eye(), camera.direction((i + 0.5) * step, (j + 0.5) * step)});
    std::vector<RayHit> hits(rays.size());
    surface.intersect(rays, resolutionOf(surface, camera), hits);
    std::vector<Vec3d> points;
    for (size_t k = 0; k < rays.size(); ++k)
        if (hits[k].found()) points.push_back(rays[k].origin + rays[k].direction * hits[k].distance);
    return points;
}

Camera framing(const Surface& surface, CameraOptions options) {
    const Camera far = Camera::around(surface.box(), options);
    const std::vector<Vec3d> seen = visiblePoints(surface, far);
    options.margin = kFramingMargin;
    return seen.size() < 2 ? far : Camera::around(seen, options);
}

SurfaceView viewRows(const Surface& surface, const Camera& camera, int samples, const RowsOfPixels& range,
                     const Monitor& monitor) {
    if (samples < 1 || samples > 16)
        throw ValueError(fmt::format("{} samples along the edge of a pixel; give 1 to 16", samples));
    SurfaceView view{.camera = camera,
                     .samples = samples,
                     .resolution = resolutionOf(surface, camera),
                     .rows = range,
                     .hits = {},
                     .first = {0}};
    std::vector<RowOfHits> rows(static_cast<size_t>(range.end - range.begin));
    parallelFor(
        rows.size(), 1,
        [&](size_t k, size_t) {
            rows[k] = viewRow(surface, camera, samples, range.begin + static_cast<int>(k), view.resolution);
        },
        monitor);
    size_t hits = 0;
    for (const RowOfHits& row : rows) hits += row.hits.size();
    view.hits.reserve(hits);
    view.first.reserve(rows.size() * static_cast<size_t>(camera.width()) + 1);
    for (RowOfHits& row : rows) {
        view.hits.insert(view.hits.end(), row.hits.begin(), row.hits.end());
        for (const size_t count : row.counts) view.first.push_back(view.first.back() + count);
        row = {};
    }
    return view;
}

SurfaceView viewSurface(const Surface& surface, const Camera& camera, int samples, const Monitor& monitor) {
    const double pixels = static_cast<double>(camera.width()) * camera.height(), perPixel = 1.0 * samples * samples;
    requireMemory(2.1 * pixelsOf(surface, camera) * perPixel * sizeof(SurfaceSample) + pixels * sizeof(size_t),
                  fmt::format("{} x {} pixels with {} samples each", camera.width(), camera.height(), perPixel),
                  "choose a smaller width and height, or fewer samples");
    return viewRows(surface, camera, samples, {0, camera.height()}, monitor);
}

} // namespace curlew
