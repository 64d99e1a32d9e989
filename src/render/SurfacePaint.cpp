// SPDX-License-Identifier: Apache-2.0
#include "curlew/render/SurfacePaint.h"

#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/picture/Display.h"
#include "curlew/render/ThinFilm.h"

#include <algorithm>

namespace curlew {

namespace {

std::vector<float> valuesAt(const SliceSource& source, const std::vector<Vec3d>& positions, const Monitor& monitor) {
    std::vector<float> values(positions.size());
    forEachBatch(
        positions,
        [&](const PointBatch& points, size_t begin) {
            SliceSource::Values batch(1);
            source.eval(points, batch);
            std::copy_n(batch[0].begin(), points.size, values.begin() + static_cast<std::ptrdiff_t>(begin));
        },
        monitor);
    return values;
}

/// Returns a scale over the range of most of these values.
ColorScale scaleOf(const std::vector<float>& values) {
    const bool positive = std::none_of(values.begin(), values.end(), [](float v) { return v < 0; });
    return automaticScale(
        {.width = static_cast<int>(values.size()), .height = 1, .channels = {"value"}, .pixels = values},
        positive ? ColorMap::viridis : ColorMap::diverging);
}

/// Returns a colour for each index k.
template <class ColorOf>
std::vector<Vec3f> colorEach(size_t count, const Monitor& monitor, const ColorOf& colorOf) {
    std::vector<Vec3f> colors(count);
    parallelFor(
        count, 1024,
        [&](size_t begin, size_t end) {
            for (size_t k = begin; k < end; ++k) colors[k] = colorOf(k);
        },
        monitor);
    return colors;
}

/// Returns the height of a position in the box, from 0 at its bottom to 1 at its top; 1/2 if the box is flat.
double heightIn(const Box& box, const Vec3d& position) {
    const double size = box.size()[1];
    return size > 0 ? (position[1] - box.lower[1]) / size : 0.5;
}

/// Returns the reflection of a film whose thickness grows from the top of the box to its bottom.
std::vector<Vec3f> filmColors(const SurfaceView& view, const std::vector<Vec3d>& positions, const Box& box,
                              const Interval& thickness, const Monitor& monitor) {
    const ThinFilm film(std::max(thickness.lower, thickness.upper));
    return colorEach(positions.size(), monitor, [&](size_t k) {
        const double size = box.size()[1];
        const double down = size > 0 ? std::clamp((box.upper[1] - positions[k][1]) / size, 0.0, 1.0) : 0.5;
        const SurfaceSample& hit = view.hits[k];
        const Vec3d toEye = view.camera.eye() - hit.position;
        Vec3d normal;
        for (int axis = 0; axis < 3; ++axis) normal[axis] = static_cast<double>(hit.normal[axis]);
        const Vec3d light = film.reflectance(thickness.lower + down * (thickness.upper - thickness.lower),
                                             dot(normal, toEye) / length(toEye));
        Vec3f color;
        for (int c = 0; c < 3; ++c) color[c] = static_cast<float>(displayFromLinear(std::max(light[c], 0.0)));
        return color;
    });
}

/// Returns the colours of a texture that needs no flow or source.
std::vector<Vec3f> textureColors(const SurfaceView& view, const std::vector<Vec3d>& places, const SurfacePaint& paint,
                                 const Monitor& monitor) {
    const auto each = [&](const auto& colorOf) { return colorEach(places.size(), monitor, colorOf); };
    const Box& box = paint.box;
    switch (paint.texture) {
        case Texture::checker:
            return each([&](size_t k) { return checkerAt(places[k], paint.edge, paint.color, paint.second); });
        case Texture::waves:
            return each([&](size_t k) { return wavesAt(places[k], paint.edge); });
        case Texture::latitude:
            return each([&](size_t k) { return latitudeAt(places[k], box.center()); });
        case Texture::terrain:
            return each([&](size_t k) { return terrainAt(heightIn(box, places[k])); });
        case Texture::film:
            return filmColors(view, places, box, paint.film, monitor);
        case Texture::none:
        case Texture::lic:
            break;
    }
    return {paint.color};
}

void requireFlow(const SurfacePaint& paint) {
    if ((paint.carry.time != 0 || paint.texture == Texture::lic) && !paint.flow)
        throw ValueError("a texture of streaks, or a carried texture, needs a flow");
}

/// Moves hits to where their colours are looked up.
std::optional<AdvectResult> carry(const SurfacePaint& paint, std::vector<Vec3d>& places, const Monitor& monitor) {
    if (paint.carry.time == 0 || places.empty()) return {};
    return advect(*paint.flow, places, paint.carry, monitor);
}

} // namespace

PaintRange paintRange(const std::vector<Vec3d>& positions, double resolution, const SurfacePaint& paint,
                      const Monitor& monitor) {
    requireFlow(paint);
    PaintRange range;
    if (positions.empty()) return range;
    if (paint.source) {
        std::vector<Vec3d> places = positions;
        carry(paint, places, monitor);
        range.source = scaleOf(valuesAt(*paint.source, places, monitor));
    }
    if (paint.texture == Texture::lic)
        range.streaks = surfaceLicRange(positions, resolution, *paint.flow, {.seed = paint.seed}, monitor);
    return range;
}

PaintedColors paintedColors(const SurfaceView& view, const SurfacePaint& paint, const Monitor& monitor) {
    requireFlow(paint);
    const PaintRange range = paint.range.value_or(PaintRange{});
    std::vector<Vec3d> places = positionsOf(view);
    PaintedColors painted;
    painted.carried = carry(paint, places, monitor);
    if (paint.source && !places.empty()) {
        const std::vector<float> values = valuesAt(*paint.source, places, monitor);
        const ColorScale scale = range.source ? *range.source : scaleOf(values);
        painted.colors = colorEach(values.size(), monitor, [&](size_t k) {
            return colorAt(scale.map, (values[k] - scale.lower) / (scale.upper - scale.lower));
        });
    } else
        painted.colors = textureColors(view, places, paint, monitor);
    if (paint.texture != Texture::lic) return painted;
    const std::vector<float> streaks =
        surfaceLic(view, *paint.flow, {.seed = paint.seed, .range = range.streaks}, monitor);
    painted.colors = colorEach(streaks.size(), monitor, [&](size_t k) {
        return (painted.colors.size() == 1 ? painted.colors[0] : painted.colors[k]) * (0.3f + 0.9f * streaks[k]);
    });
    return painted;
}

} // namespace curlew
