// SPDX-License-Identifier: Apache-2.0
#include "curlew/render/Splat.h"

#include "LightKernel.h"
#include "SplatBins.h"
#include "curlew/base/Parallel.h"
#include "curlew/math/Dispatch.h"
#include "curlew/picture/Display.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace curlew {

using namespace detail;

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

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

/// Visits the parts of an edge, or a point, whose radii change little, by their ends.
template <class Visit>
void forEvenParts(const SplatBins& bins, size_t k, const Visit& visit) {
    const SplatVertex &a = bins.vertex(k), &b = bins.vertex(bins.lines() ? k + 1 : k);
    const int parts = bins.evenParts(std::min(a.depth, b.depth), std::max(a.depth, b.depth));
    if (parts == 1) return visit(a, b);
    // From the far end, where parts are long in space, so that rounding does not matter.
    const SplatVertex &far = a.depth > b.depth ? a : b, &near = a.depth > b.depth ? b : a;
    const float ratio = far.depth / near.depth;
    const auto at = [&](int part) {
        const float nearness = std::pow(ratio, static_cast<float>(part) / static_cast<float>(parts));
        return between(far, near, (nearness - 1) / (ratio - 1));
    };
    for (int part = 0; part < parts; ++part) visit(at(part), at(part + 1));
}

/// An edge in pixels, whose radius and depth change linearly along it. One of length 0 is a point: its nearer end.
struct Stroke {
    Stroke(const SplatBins& bins, const SplatVertex& from, const SplatVertex& to, float visible) : a(from), b(to) {
        const float dx = b.x - a.x, dy = b.y - a.y;
        length = std::sqrt(dx * dx + dy * dy);
        if (!(length > 0)) a = b = from.depth < to.depth ? from : to;
        radius = bins.drawnRadius(a.depth) * visible;
        most = radius;
        if (!(length > 0)) return;
        ux = dx / length, uy = dy / length;
        const float end = bins.drawnRadius(b.depth) * visible;
        widens = (end - radius) / length;
        most = std::max(radius, end);
        narrow = 1 - widens * widens;
        const float recedes = (b.depth - a.depth) * bins.pixelsPerUnit(0.5f * (a.depth + b.depth)) / length;
        if (narrow > 0) lean = recedes / std::sqrt(narrow + recedes * recedes);
    }

    /// Returns the samples of a tile whose centres the footprint may cover, from the tile's corner.
    SampleBox samplesIn(const SplatTile& tile) const {
        const auto scale = static_cast<float>(kFine);
        const auto range = [&](float lower, float upper, int origin, int size) {
            const auto o = static_cast<float>(origin), last = static_cast<float>(size * kFine);
            return std::pair(static_cast<int>(std::clamp((lower - most - o) * scale + 0.5f, 0.0f, last)),
                             static_cast<int>(std::clamp((upper + most - o) * scale + 0.5f, 0.0f, last)));
        };
        const auto [left, right] = range(std::min(a.x, b.x), std::max(a.x, b.x), tile.left, tile.width);
        const auto [top, bottom] = range(std::min(a.y, b.y), std::max(a.y, b.y), tile.top, tile.height);
        return {left, top, right, bottom};
    }

    /// Returns how far along the edge the ball is that shows its surface at an offset from a. The edge's surface is
    /// that of balls, a cone, which recedes with the edge. Not finite where there is no surface.
    float alongAt(float ahead, float across) const {
        if (!(narrow > 0)) return widens > 0 ? length : 0; // the larger end covers all others
        // The depth of a ball's surface, recedes s - √(r² - across² - (ahead - s)²) where r is linear in s, is least.
        const float r = radius + widens * ahead, back = lean * std::sqrt(r * r - narrow * across * across) - widens * r;
        return std::clamp(ahead - back / narrow, 0.0f, length);
    }

    /// Returns which part of the edge, from 0 at a to 1 at b, is no farther from a tile than the radius, horizontally
    /// and vertically.
    std::pair<float, float> partNear(const SplatTile& tile) const {
        float from = 0, to = 1;
        const auto limit = [&](float start, float step, int origin, int size) {
            const auto o = static_cast<float>(origin), last = o + static_cast<float>(size);
            const float enters = (o - most - start) / step, leaves = (last + most - start) / step;
            from = std::max(from, std::min(enters, leaves)); // not if NaN: the edge runs along a side of the tile
            to = std::min(to, std::max(enters, leaves));
        };
        limit(a.x, b.x - a.x, tile.left, tile.width);
        limit(a.y, b.y - a.y, tile.top, tile.height);
        return {from, to};
    }

    SplatVertex a, b;
    float length = 0, ux = 1, uy = 0; ///< From a to b.
    float radius, most;               ///< That is drawn at a, and the largest one; pixels.
    float widens = 0;                 ///< Change of the radius per pixel of the length.
    float narrow = 1;                 ///< 1 - widens².
    float lean = 0;                   ///< For alongAt(). Of a tube, the sine of the angle at which it recedes.
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
            const size_t k = mTile.splats[n];
            forEvenParts(mBins, k, [&](const SplatVertex& a, const SplatVertex& b) { add(a, b, mBins.fade(k)); });
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
    void add(const SplatVertex& a, const SplatVertex& b, float fade) {
        constexpr float kShort = ProjectedSplats::kShort;
        constexpr float kColorError = 1.0f / 128; // of linear light
        constexpr float kEndless = 1e12f;         // pieces; such an edge ends beside the eye
        const float dx = b.x - a.x, dy = b.y - a.y, error = mBins.colorError(a.value, b.value);
        const float middle = 0.5f * (a.depth + b.depth);
        if (dx * dx + dy * dy <= kShort * kShort && error <= kColorError) return addShort(a, b, middle, fade);
        const Stroke s(mBins, a, b, 1);
        // The error of a curve shrinks with the square of a piece's length (at a kink of the colour map, with the
        // length). Below a pixel, it does not show.
        const float colors = std::min(std::sqrt(error / kColorError), std::max(s.length, 1.0f));
        const float pieces = std::max(s.length / std::max(kShort, 4 * s.most), colors);
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

void cover(const SplatBins& bins, const Stroke& stroke, const SplatTile& tile, std::vector<Sample>& samples) {
    const float front = std::min(stroke.a.depth, stroke.b.depth);
    const float nearest = front - stroke.most / bins.pixelsPerUnit(front);
    const float perPixel = stroke.length > 0 ? 1 / stroke.length : 0;
    const size_t row = static_cast<size_t>(tile.width) * kFine;
    stroke.samplesIn(tile).forEach([&](int x, int y) {
        Sample& sample = samples[static_cast<size_t>(y) * row + static_cast<size_t>(x)];
        if (!(nearest < sample.depth)) return;
        const auto position = [](int origin, int k) {
            return static_cast<float>(origin) + (static_cast<float>(k) + 0.5f) / kFine;
        };
        const float dx = position(tile.left, x) - stroke.a.x, dy = position(tile.top, y) - stroke.a.y;
        const float ahead = dx * stroke.ux + dy * stroke.uy, across = dx * stroke.uy - dy * stroke.ux;
        if (!(std::abs(across) < stroke.most)) return;
        const float along = stroke.alongAt(ahead, across), r = stroke.radius + stroke.widens * along;
        const float left = r * r - across * across - (ahead - along) * (ahead - along);
        if (!(left > 0)) return;
        const SplatVertex middle = between(stroke.a, stroke.b, along * perPixel);
        const float nx = dx - along * stroke.ux, ny = dy - along * stroke.uy, nz = std::sqrt(left);
        const float z = middle.depth - nz / bins.pixelsPerUnit(middle.depth);
        if (!(z < sample.depth)) return;
        const float unit = 1 / r, light = shade(nx * unit, -ny * unit, nz * unit) * bins.haze(middle.depth);
        sample = {z, bins.color(middle.value) * light};
    });
}

void coverTile(const SplatBins& bins, const SplatTile& tile, std::vector<Sample>& samples) {
    samples.assign(static_cast<size_t>(tile.width * kFine) * static_cast<size_t>(tile.height * kFine), {});
    for (const uint32_t k : tile.splats)
        forEvenParts(bins, k, [&](const SplatVertex& a, const SplatVertex& b) {
            cover(bins, Stroke(bins, a, b, bins.fade(k)), tile, samples);
        });
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

} // namespace

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
