// SPDX-License-Identifier: Apache-2.0
#include "curlew/render/SurfacePicture.h"

#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <thread>

namespace curlew {

namespace {

constexpr int kRows = 4; ///< Rows of pixels that are drawn at a time.

/// What a picture needs to know of the rows that one thread has drawn.
struct Drawn {
    size_t hits = 0;
    std::array<std::optional<AdvectResult>, 2> carried; ///< Of the far side and the near one.
};

/// Returns the hits of a coarse grid of rays; if they are few, those of one ray per pixel; if none of these hits, of
/// all rays.
std::vector<Vec3d> typicalHits(const Surface& surface, const Camera& camera, int samples, const Monitor& monitor) {
    constexpr size_t kEnough = 1000;
    std::vector<Vec3d> hits = visiblePoints(surface, camera);
    if (hits.size() < kEnough) hits = positionsOf(viewSurface(surface, camera, 1, monitor));
    return hits.empty() ? positionsOf(viewSurface(surface, camera, samples, monitor)) : hits;
}

} // namespace

CarriedTexture& CarriedTexture::operator+=(const AdvectResult& part) {
    const auto steps = static_cast<double>(substeps), more = static_cast<double>(part.substeps);
    if (more > 0) meanIterations += (part.meanIterations - meanIterations) * (more / (steps + more));
    notConverged += part.notConverged;
    retries += part.retries;
    substeps += part.substeps;
    return *this;
}

SurfacePicture drawSurface(const Surface& surface, const Camera& camera, const SurfacePictureOptions& o,
                           const Image* behind, const Monitor& monitor) {
    constexpr double kBytes = 250; // of rays, hits and colours, per sample of the rows that are drawn at a time
    const double pixels = static_cast<double>(camera.width()) * camera.height(), perPixel = 1.0 * o.samples * o.samples;
    const double atOnce = kRows * static_cast<double>(camera.width()) * std::thread::hardware_concurrency();
    requireMemory(
        5 * sizeof(float) * pixels + kBytes * perPixel * std::min(atOnce, pixels),
        fmt::format("a picture of {} x {} pixels with {} samples each", camera.width(), camera.height(), perPixel),
        "choose a smaller width and height, or fewer samples");
    SurfacePicture picture{.image = behind ? *behind : backgroundPicture(camera, o.look, monitor.quiet())};
    SurfacePaint paint = o.paint;
    if (!paint.range && (paint.source || paint.texture == Texture::lic))
        paint.range = paintRange(typicalHits(surface, camera, o.samples, monitor.quiet()),
                                 resolutionOf(surface, camera), paint, monitor.quiet());
    const int height = camera.height();
    std::vector<Drawn> drawn(static_cast<size_t>((height + kRows - 1) / kRows));
    const auto draw = [&](size_t part) {
        const Monitor inner = monitor.quiet();
        const int top = static_cast<int>(part) * kRows;
        const SurfaceView near = viewRows(surface, camera, o.samples, {top, std::min(top + kRows, height)}, inner);
        Drawn& mine = drawn[part];
        mine.hits = near.hits.size();
        const auto shade = [&](const SurfaceView& view) {
            PaintedColors painted = paintedColors(view, paint, inner);
            shadeOnto(picture.image, view, painted.colors, o.look, o.shadows ? &surface : nullptr, inner);
            return painted.carried;
        };
        if (o.look.finish == Finish::mirror) mine.carried[0] = shade(viewThrough(surface, near, inner));
        mine.carried[1] = shade(near);
    };
    parallelFor(
        drawn.size(), 1, [&](size_t part, size_t) { isolated([&] { draw(part); }); }, monitor);
    for (const Drawn& part : drawn) {
        picture.hits += part.hits;
        for (const auto& carried : part.carried)
            if (carried) (picture.carried ? *picture.carried : picture.carried.emplace()) += *carried;
    }
    picture.coverage = static_cast<double>(picture.hits) /
                       (static_cast<double>(camera.width()) * camera.height() * o.samples * o.samples);
    return picture;
}

} // namespace curlew
