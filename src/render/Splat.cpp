// SPDX-License-Identifier: Apache-2.0
#include "curlew/render/Splat.h"

#include "LightKernel.h"
#include "SplatBins.h"
#include "curlew/base/Parallel.h"
#include "curlew/math/Dispatch.h"
#include "curlew/math/Percentile.h"
#include "curlew/picture/Display.h"
#include "curlew/track/Scatter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace curlew {

using namespace detail;

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr double kStrays = 0.5; ///< Outliers are this far outside the percentile range, relative to its size.

void checkDepth(std::span<const float> depth, const Camera& camera) {
    const size_t pixels = static_cast<size_t>(camera.width()) * static_cast<size_t>(camera.height());
    if (!depth.empty() && depth.size() != pixels)
        throw ValueError(fmt::format("{} depths for {} pixels", depth.size(), pixels));
}

constexpr int kFine = 4; ///< Samples of opaque splats along a pixel's edge.

struct SampleBox {
    int left, top, right, bottom;

    template <class Visit>
    void forEach(const Visit& visit) const {
        for (int y = top; y < bottom; ++y)
            for (int x = left; x < right; ++x) visit(x, y);
    }
};

/// Returns what is seen at a part of the way from a to b in the picture, where depths change as in perspective.
SplatVertex between(const SplatVertex& a, const SplatVertex& b, float part) {
    const float depth = a.depth / (1 + (a.depth / b.depth - 1) * part), along = part * depth / b.depth;
    return {a.x + (b.x - a.x) * part, a.y + (b.y - a.y) * part, depth, a.value + (b.value - a.value) * along};
}

/// An edge in pixels; a point is an edge of length 0.
struct Stroke {
    Stroke(const SplatBins& bins, size_t k)
        : a(bins.vertex(k)), b(bins.vertex(bins.lines() ? k + 1 : k)), fade(bins.fade(k)) {
        const float dx = b.x - a.x, dy = b.y - a.y;
        length = std::sqrt(dx * dx + dy * dy);
        if (length > 0) ux = dx / length, uy = dy / length;
        radius = std::max(bins.radius(0.5f * (a.depth + b.depth)), bins.leastRadius());
    }

    /// Returns the samples of a tile whose centres the footprint may cover, from the tile's corner.
    SampleBox samplesIn(const SplatTile& tile) const {
        const auto scale = static_cast<float>(kFine);
        const auto range = [&](float lower, float upper, int origin, int size) {
            const auto o = static_cast<float>(origin), most = static_cast<float>(size * kFine);
            return std::pair(static_cast<int>(std::clamp((lower - radius - o) * scale + 0.5f, 0.0f, most)),
                             static_cast<int>(std::clamp((upper + radius - o) * scale + 0.5f, 0.0f, most)));
        };
        const auto [left, right] = range(std::min(a.x, b.x), std::max(a.x, b.x), tile.left, tile.width);
        const auto [top, bottom] = range(std::min(a.y, b.y), std::max(a.y, b.y), tile.top, tile.height);
        return {left, top, right, bottom};
    }

    /// Returns which part of the edge, from 0 at a to 1 at b, is no farther from a tile than the radius, horizontally
    /// and vertically.
    std::pair<float, float> partNear(const SplatTile& tile) const {
        float from = 0, to = 1;
        const auto limit = [&](float start, float step, int origin, int size) {
            const auto o = static_cast<float>(origin), most = o + static_cast<float>(size);
            const float enters = (o - radius - start) / step, leaves = (most + radius - start) / step;
            from = std::max(from, std::min(enters, leaves)); // not if NaN: the edge runs along a side of the tile
            to = std::min(to, std::max(enters, leaves));
        };
        limit(a.x, b.x - a.x, tile.left, tile.width);
        limit(a.y, b.y - a.y, tile.top, tile.height);
        return {from, to};
    }

    /// Returns the sine of the angle by which the edge recedes from the plane of the picture.
    float sineOfTilt(const SplatBins& bins) const {
        const float recedes = (b.depth - a.depth) * bins.pixelsPerUnit(0.5f * (a.depth + b.depth));
        return recedes != 0 ? recedes / std::sqrt(recedes * recedes + length * length) : 0;
    }

    SplatVertex a, b;
    float length = 0, ux = 1, uy = 0; ///< From a to b.
    float fade;                       ///< Visibility, 0 to 1.
    float radius;                     ///< That is drawn, pixels.
};

/// Draws the light of a tile's splats.
class LightPainter {
  public:
    LightPainter(const SplatBins& bins, const SplatTile& tile, std::span<const float> depth, int width)
        : mBins(bins), mTile(tile) {
        mLit.left = tile.left;
        mLit.top = tile.top;
        mLit.hides = !depth.empty();
        for (auto& pixels : mLit.light) pixels.fill(0);
        if (mLit.hides)
            for (int y = 0; y < tile.height; ++y)
                for (int x = 0; x < tile.width; ++x) mLit.depth[LitTile::pixel(x, y)] = depth[imagePixel(x, y, width)];
    }

    void draw() {
        constexpr size_t kAhead = 16;
        for (size_t n = 0; n < mTile.splats.size(); ++n) {
            if (n + kAhead < mTile.splats.size()) mBins.prefetch(mTile.splats[n + kAhead]);
            add(mTile.splats[n]);
        }
        flush();
    }

    void copyTo(Image& image) const {
        for (int y = 0; y < mTile.height; ++y)
            for (int x = 0; x < mTile.width; ++x)
                for (size_t i = 0; i < 3; ++i)
                    image.pixels[3 * imagePixel(x, y, image.width) + i] = mLit.light[i][LitTile::pixel(x, y)];
    }

  private:
    size_t imagePixel(int x, int y, int width) const {
        return static_cast<size_t>(mTile.top + y) * static_cast<size_t>(width) + static_cast<size_t>(mTile.left + x);
    }

    /// Adds an edge in pieces that are so short that their light may be linear, but not much shorter than wide.
    void add(size_t k) {
        constexpr float kShort = ProjectedSplats::kShort;
        constexpr float kColorError = 1.0f / 128; // of linear light
        constexpr float kEndless = 1e12f;         // pieces; such an edge ends beside the eye
        const SplatVertex &a = mBins.vertex(k), &b = mBins.vertex(mBins.lines() ? k + 1 : k);
        const float dx = b.x - a.x, dy = b.y - a.y, error = mBins.colorError(a.value, b.value);
        const float middle = 0.5f * (a.depth + b.depth), fade = mBins.fade(k);
        if (dx * dx + dy * dy <= kShort * kShort && error <= kColorError) return addShort(a, b, middle, fade);
        const Stroke s(mBins, k);
        // The error of a curve shrinks with the square of a piece's length (at a kink of the colour map, with the
        // length). Below a pixel, it does not show.
        const float colors = std::min(std::sqrt(error / kColorError), std::max(s.length, 1.0f));
        const float pieces = std::max(s.length / std::max(kShort, 4 * s.radius), colors);
        if (pieces <= 1) return addShort(a, b, middle, fade);
        const auto [from, to] = s.partNear(mTile);
        if (!(pieces < kEndless && from < to)) return;
        const double count = std::ceil(static_cast<double>(pieces));
        const auto at = [&](int64_t piece) {
            return between(a, b, static_cast<float>(static_cast<double>(piece) / count));
        };
        const auto end = static_cast<int64_t>(std::ceil(static_cast<double>(to) * count));
        for (auto piece = static_cast<int64_t>(static_cast<double>(from) * count); piece < end; ++piece)
            addShort(at(piece), at(piece + 1), middle, fade);
    }

    void addShort(const SplatVertex& a, const SplatVertex& b, float middle, float fade) {
        mEdges.push(a, b, middle, fade);
        if (mEdges.full()) flush();
    }

    void flush() {
        const bool lines = mBins.lines();
        runKernel<StrokeKernel, float>(std::as_const(mEdges), mBins.look(), mTile, mStrokes);
        runKernel<LightKernel, float>(std::as_const(mEdges), std::as_const(mStrokes), lines, mLit);
        mEdges.size = 0;
    }

    const SplatBins& mBins;
    const SplatTile& mTile;
    LitTile mLit;
    LightEdges mEdges;
    LightStrokes mStrokes;
};

/// Returns the shade of a surface with that normal, seen by a camera that looks along -z, lit from the upper left and a
/// little from all sides.
float shade(float nx, float ny, float nz) {
    constexpr float kX = -0.45f, kY = 0.65f, kZ = 0.612f; // a unit vector
    const float lit = std::max(nx * kX + ny * kY + nz * kZ, 0.0f);
    return 0.22f + 0.78f * lit;
}

struct Sample {
    float depth = kInfinity;
    Vec3f light{};
};

void coverTile(const SplatBins& bins, const SplatTile& tile, std::vector<Sample>& samples) {
    const size_t row = static_cast<size_t>(tile.width) * kFine;
    samples.assign(row * static_cast<size_t>(tile.height) * kFine, {});
    for (const uint32_t index : tile.splats) {
        Stroke stroke(bins, index);
        stroke.radius *= stroke.fade;
        const float rr = stroke.radius * stroke.radius, front = std::min(stroke.a.depth, stroke.b.depth);
        const float nearest = front - stroke.radius / bins.pixelsPerUnit(front);
        const float lean = stroke.sineOfTilt(bins);
        stroke.samplesIn(tile).forEach([&](int x, int y) {
            Sample& sample = samples[static_cast<size_t>(y) * row + static_cast<size_t>(x)];
            if (!(nearest < sample.depth)) return;
            const auto position = [](int origin, int k) {
                return static_cast<float>(origin) + (static_cast<float>(k) + 0.5f) / kFine;
            };
            const float dx = position(tile.left, x) - stroke.a.x, dy = position(tile.top, y) - stroke.a.y;
            const float ahead = dx * stroke.ux + dy * stroke.uy, across = dx * stroke.uy - dy * stroke.ux;
            const float halfSquared = rr - across * across;
            if (!(halfSquared > 0)) return;
            // The nearest position on the axis to the visible surface, which a tube that recedes shows farther ahead.
            const float along = std::clamp(ahead - lean * std::sqrt(halfSquared), 0.0f, stroke.length);
            const float left = halfSquared - (ahead - along) * (ahead - along);
            if (!(left > 0)) return;
            const float nx = dx - along * stroke.ux, ny = dy - along * stroke.uy;
            const float part = stroke.length > 0 ? along / stroke.length : 0, nz = std::sqrt(left);
            const SplatVertex middle = between(stroke.a, stroke.b, part);
            const float z = middle.depth - nz / bins.pixelsPerUnit(middle.depth);
            if (!(z < sample.depth)) return;
            const float r = 1 / stroke.radius, light = shade(nx * r, -ny * r, nz * r) * bins.haze(middle.depth);
            sample = {z, bins.color(middle.value) * light};
        });
    }
}

/// Averages a tile's visible samples into R, G, B, A, Z.
void resolveTile(const SplatTile& tile, const std::vector<Sample>& samples, std::span<const float> depth,
                 Image& image) {
    const size_t row = static_cast<size_t>(tile.width) * kFine;
    for (int y = 0; y < tile.height; ++y)
        for (int x = 0; x < tile.width; ++x) {
            const size_t pixel = static_cast<size_t>(tile.top + y) * static_cast<size_t>(image.width) +
                                 static_cast<size_t>(tile.left + x);
            float wall = kInfinity;
            if (!depth.empty()) wall = depth[pixel];
            Sample sum;
            float count = 0;
            for (int k = 0; k < kFine * kFine; ++k) {
                const Sample& s = samples[static_cast<size_t>(y * kFine + k / kFine) * row +
                                          static_cast<size_t>(x * kFine + k % kFine)];
                if (!(s.depth < wall)) continue;
                sum.light = sum.light + s.light;
                sum.depth = std::min(sum.depth, s.depth);
                ++count;
            }
            float* const to = &image.pixels[5 * pixel];
            for (int i = 0; i < 3 && count > 0; ++i)
                to[i] = static_cast<float>(displayFromLinear(static_cast<double>(sum.light[i] / count)));
            to[3] = count / (kFine * kFine);
            to[4] = sum.depth;
        }
}

Vec3d positionOf(const Splats& splats, size_t k) { return {{splats.x[k], splats.y[k], splats.z[k]}}; }
bool isFinite(const Vec3d& p) { return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]); }

Box boundsOf(const Splats& splats) {
    Box box{Vec3d{{1, 1, 1}} * HUGE_VAL, Vec3d{{1, 1, 1}} * -HUGE_VAL};
    for (size_t k = 0; k < splats.x.size(); ++k) {
        const Vec3d p = positionOf(splats, k);
        if (!isFinite(p)) continue;
        for (int axis = 0; axis < 3; ++axis) {
            box.lower[axis] = std::min(box.lower[axis], p[axis]);
            box.upper[axis] = std::max(box.upper[axis], p[axis]);
        }
    }
    if (!(box.lower[0] <= box.upper[0])) throw ValueError("there is nothing to draw: no point has a finite position");
    return box;
}

/// Returns enough positions of the splats, without the outliers in the picture. Of few positions none is an outlier.
std::vector<Vec3d> withoutStrays(const Splats& splats, const Camera& far) {
    constexpr size_t kFew = 200; // the outermost of these are at the percentiles 0.5 and 99.5
    std::vector<Vec3d> points;
    std::vector<double> across, upwards;
    forEnough(splats.x.size(), [&](size_t k) {
        const Vec3d p = positionOf(splats, k);
        if (!isFinite(p)) return;
        points.push_back(p);
        across.push_back(dot(p, far.right()));
        upwards.push_back(dot(p, far.up()));
    });
    if (points.size() < kFew) return points;
    const auto rangeOf = [](std::vector<double> values) {
        const Interval range = percentiles(std::move(values), 0.005, 0.995);
        const double margin = kStrays * (range.upper - range.lower);
        return Interval{range.lower - margin, range.upper + margin};
    };
    const Interval x = rangeOf(std::move(across)), y = rangeOf(std::move(upwards));
    std::erase_if(points,
                  [&](const Vec3d& p) { return !x.contains(dot(p, far.right())) || !y.contains(dot(p, far.up())); });
    return points;
}

/// Returns enough points of the wall's surface to frame it; empty if the wall is unbounded.
std::vector<Vec3d> placesOnWall(const Domain& domain) {
    constexpr size_t kPlaces = 2000;
    std::vector<Vec3d> places;
    if (!domain.wall || !domain.wall->sdf.bounds.finite()) return places;
    const Domain around{.box = domain.wall->sdf.bounds, .wall = domain.wall};
    const Points points = scatterFrom(around, 0, kPlaces, ScatterOptions{.on = ScatterOn::surface});
    for (size_t k = 0; k < points.size(); ++k) places.push_back(points.position(k));
    return places;
}

} // namespace

Splats Splats::of(const Points& points) { return {.x = points.x, .y = points.y, .z = points.z, .fade = points.fade}; }

Splats Splats::of(const Curves& curves) {
    Splats splats{.x = curves.x, .y = curves.y, .z = curves.z, .start = curves.start};
    for (size_t k = 0; k < curves.size(); ++k) splats.closed.push_back(curves.closed(k) ? 1 : 0);
    return splats;
}

Box Splats::bounds() const { return boundsOf(*this); }

Camera framing(const Splats& splats, const std::optional<Domain>& domain, CameraOptions options) {
    std::vector<Vec3d> points = domain ? placesOnWall(*domain) : std::vector<Vec3d>();
    if (splats.x.empty() && points.empty() && domain) return Camera::around(domain->box, options);
    if (!splats.x.empty()) {
        const Box bounds = boundsOf(splats);
        const Camera far = Camera::around(bounds.padded(std::max(1e-6 * length(bounds.size()), 1e-9)), options);
        const std::vector<Vec3d> seen = withoutStrays(splats, far);
        const bool onePlace = bounds.size() == Vec3d{} || seen.size() < 2;
        if (points.empty() && onePlace) return far;
        points.insert(points.end(), seen.begin(), seen.end());
    }
    options.margin = kFramingMargin;
    return Camera::around(points, options);
}

SplatImage luminous(const Splats& splats, const Camera& camera, const SplatOptions& options,
                    std::span<const float> depth, const Monitor& monitor) {
    checkDepth(depth, camera);
    const SplatBins bins(splats, camera, options, monitor);
    Image image = filledImage(camera.width(), camera.height(), {"R", "G", "B"});
    parallelFor(
        bins.tiles(), 1,
        [&](size_t begin, size_t end) {
            for (size_t k = begin; k < end; ++k) {
                const SplatTile tile = bins.tile(k);
                LightPainter painter(bins, tile, depth, image.width);
                painter.draw();
                painter.copyTo(image);
            }
        },
        monitor);
    const auto pixels = static_cast<double>(image.pixels.size()) / 3;
    size_t covered = 0;
    for (size_t k = 0; k < image.pixels.size(); k += 3)
        covered += image.pixels[k] + image.pixels[k + 1] + image.pixels[k + 2] > 0.01f ? 1 : 0;
    return {std::move(image), bins.drawn(), static_cast<double>(covered) / pixels};
}

SplatImage opaque(const Splats& splats, const Camera& camera, const SplatOptions& options, std::span<const float> depth,
                  const Monitor& monitor) {
    checkDepth(depth, camera);
    const SplatBins bins(splats, camera, options, monitor);
    Image image = filledImage(camera.width(), camera.height(), {"R", "G", "B", "A", "Z"});
    parallelFor(
        bins.tiles(), 1,
        [&](size_t begin, size_t end) {
            std::vector<Sample> samples;
            for (size_t k = begin; k < end; ++k) {
                coverTile(bins, bins.tile(k), samples);
                resolveTile(bins.tile(k), samples, depth, image);
            }
        },
        monitor);
    const auto pixels = static_cast<double>(image.pixels.size()) / 5;
    double covered = 0;
    for (size_t k = 3; k < image.pixels.size(); k += 5) covered += static_cast<double>(image.pixels[k]);
    return {std::move(image), bins.drawn(), covered / pixels};
}

} // namespace curlew
