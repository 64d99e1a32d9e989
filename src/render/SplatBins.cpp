// SPDX-License-Identifier: Apache-2.0
#include "SplatBins.h"

#include "TileKernel.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"
#include "curlew/math/Dispatch.h"
#include "curlew/picture/Display.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace curlew::detail {

namespace {

constexpr size_t kColors = 1024;

Row<float> linear(const Vec3f& display) {
    Row<float> light;
    for (size_t i = 0; i < 3; ++i)
        light.c[i] = static_cast<float>(linearFromDisplay(static_cast<double>(display.c[i])));
    return light;
}

/// Returns, for each colour and at the end for all, the sum of the changes of the slope before it, per unit of the
/// value, of the channel that changes most. The colours are constant below the first and above the last.
std::vector<float> changesOfSlope(const std::vector<Row<float>>& colors) {
    std::vector<float> sums{0};
    for (size_t k = 0; k < colors.size(); ++k) {
        const auto &before = colors[k > 0 ? k - 1 : 0].c, &after = colors[std::min(k + 1, colors.size() - 1)].c;
        float most = 0;
        for (size_t i = 0; i < 3; ++i) most = std::max(most, std::abs(after[i] - 2 * colors[k].c[i] + before[i]));
        sums.push_back(sums.back() + most * static_cast<float>(colors.size() - 1));
    }
    return sums;
}

/// Returns the splats if they can be drawn.
const Splats& valid(const Splats& s, const SplatOptions& o) {
    const size_t count = s.x.size();
    if (s.y.size() != count || s.z.size() != count) throw ValueError("the splat arrays x, y and z differ in length");
    if (!s.values.empty() && s.values.size() != count)
        throw ValueError(fmt::format("{} colour values for {} positions", s.values.size(), count));
    if (!s.fade.empty() && (s.fade.size() != count || !s.start.empty()))
        throw ValueError(fmt::format("{} fade values for {} positions", s.fade.size(), count));
    const size_t lines = s.start.empty() ? 0 : s.start.size() - 1;
    if (!s.closed.empty() && s.closed.size() != lines)
        throw ValueError("splats need one closed flag for each polyline");
    if (!s.start.empty() && (s.start.back() != count || !std::is_sorted(s.start.begin(), s.start.end())))
        throw ValueError("the polylines do not add up to the positions");
    if (!s.values.empty() && !(s.scale.lower < s.scale.upper))
        throw ValueError(fmt::format("a colour scale from {} to {} has no range", s.scale.lower, s.scale.upper));
    if (!(o.radius >= 0) || !std::isfinite(o.radius))
        throw ValueError(fmt::format("radius {} must be positive, or 0", o.radius));
    if (!(o.pixels > 0) || !std::isfinite(o.pixels))
        throw ValueError(fmt::format("radius {} pixels must be positive and finite", o.pixels));
    if (!(o.fade >= 0 && o.fade <= 1)) throw ValueError(fmt::format("fade {} must be between 0 and 1", o.fade));
    if (mostVertices(s) >= UINT32_MAX) throw ResourceError(fmt::format("{} positions are too many to draw", count));
    requireMemory(static_cast<double>(count + lines) * (sizeof(SplatVertex) + 3 * sizeof(uint32_t)),
                  fmt::format("a picture of {} positions", count), "draw fewer");
    return s;
}

} // namespace

SplatBins::SplatBins(const Splats& splats, const Camera& camera, const SplatOptions& options, const Monitor& monitor)
    : mWidth(camera.width()),
      mHeight(camera.height()),
      mColumns((mWidth + kTile - 1) / kTile),
      mRows((mHeight + kTile - 1) / kTile),
      mProjected(valid(splats, options), camera, monitor),
      mLook{.lines = !splats.start.empty(),
            .radius = static_cast<float>(options.radius),
            .pixels = static_cast<float>(options.pixels),
            .focal = mProjected.focal(),
            .fade = static_cast<float>(options.fade)},
      mVisible(splats.fade) {
    if (splats.values.empty()) mColors = {linear(splats.color)};
    for (size_t k = 0; k < kColors && !splats.values.empty(); ++k)
        mColors.push_back(linear(colorAt(splats.scale.map, static_cast<float>(k) / (kColors - 1))));
    mSlopes = changesOfSlope(mColors);
    mLook.colors = mColors.data();
    mLook.lastColor = static_cast<uint32_t>(mColors.size() - 1);
    sort(monitor);
}

std::array<int, 4> SplatBins::tilesOf(size_t k) const {
    const SplatVertex &a = vertex(k), &b = vertex(mLook.lines ? k + 1 : k);
    const float reach = drawnRadius(std::min(a.depth, b.depth));
    const float left = std::min(a.x, b.x) - reach, right = std::max(a.x, b.x) + reach;
    const float top = std::min(a.y, b.y) - reach, bottom = std::max(a.y, b.y) + reach;
    const auto tile = [](float pixel, int size) {
        return static_cast<int>(std::clamp(pixel, 0.0f, static_cast<float>(size - 1))) / kTile;
    };
    return {tile(left, mWidth), tile(top, mHeight), tile(right, mWidth), tile(bottom, mHeight)};
}

void SplatBins::sort(const Monitor& monitor) {
    const size_t all = static_cast<size_t>(mColumns) * static_cast<size_t>(mRows), runs = mProjected.runs().size();
    const auto forRuns = [&](const auto& use) {
        parallelFor(
            runs, 1,
            [&](size_t from, size_t to) {
                for (size_t run = from; run < to; ++run) use(run, mProjected.runs()[run]);
            },
            monitor);
    };
    const auto forTiles = [&](size_t splat, const auto& visit) {
        const auto [left, top, right, bottom] = tilesOf(splat);
        for (int row = top; row <= bottom; ++row)
            for (int column = left; column <= right; ++column)
                visit(static_cast<size_t>(row) * static_cast<size_t>(mColumns) + static_cast<size_t>(column));
    };
    const auto tileOf = uninitializedArray<float>(mProjected.runs().empty() ? 0 : mProjected.runs().back().end);
    const auto findTiles = [&](const ProjectedSplats::Run& vertices) {
        for (size_t k = vertices.begin; k < vertices.end; k += TileKernel::kMost) {
            const TileKernel::Job job{&vertex(k), std::min(TileKernel::kMost, vertices.end - k), mWidth, mHeight,
                                      mColumns};
            TileKernel::Tiles tiles;
            runKernel<TileKernel, float>(job, std::as_const(mLook), tiles);
            for (size_t n = 0; n < job.count; ++n)
                tileOf[k + n] = mProjected.standsFor(k + n) > 0 && fade(k + n) > 0 ? tiles[n] : TileKernel::kNone;
        }
    };
    struct Seen {
        size_t splats = 0;
        float near = std::numeric_limits<float>::infinity(), far = 0;
    };
    std::vector<Seen> seen(runs);
    std::vector<size_t> place(runs * all, 0); // splats of a run per tile; then where they go
    forRuns([&](size_t run, const ProjectedSplats::Run& vertices) {
        Seen& mine = seen[run];
        findTiles(vertices);
        for (size_t k = vertices.begin; k < vertices.end; ++k) {
            if (tileOf[k] == TileKernel::kNone) continue;
            if (tileOf[k] == TileKernel::kSeveral)
                forTiles(k, [&](size_t tile) { ++place[run * all + tile]; });
            else
                ++place[run * all + static_cast<size_t>(tileOf[k])];
            mine.splats += mProjected.standsFor(k);
            mine.near = std::min(mine.near, vertex(k).depth);
            mine.far = std::max(mine.far, vertex(k).depth);
        }
    });
    Seen whole;
    for (const Seen& s : seen) {
        mDrawn += s.splats;
        whole.near = std::min(whole.near, s.near);
        whole.far = std::max(whole.far, s.far);
    }
    mLook.near = whole.near;
    mLook.perDepth = whole.far > whole.near ? 1 / (whole.far - whole.near) : 0;
    size_t total = 0;
    for (size_t tile = 0; tile < all; ++tile) {
        mFirst.push_back(total);
        for (size_t run = 0; run < runs; ++run) total += std::exchange(place[run * all + tile], total);
    }
    mFirst.push_back(total);
    requireMemory(static_cast<double>(total) * sizeof(uint32_t), "a picture with such large splats",
                  "choose a smaller radius, or draw fewer");
    mSplats.resize(total);
    forRuns([&](size_t run, const ProjectedSplats::Run& vertices) {
        for (size_t k = vertices.begin; k < vertices.end; ++k) {
            const auto add = [&](size_t tile) { mSplats[place[run * all + tile]++] = static_cast<uint32_t>(k); };
            if (tileOf[k] == TileKernel::kSeveral)
                forTiles(k, add);
            else if (tileOf[k] != TileKernel::kNone)
                add(static_cast<size_t>(tileOf[k]));
        }
    });
}

SplatTile SplatBins::tile(size_t k) const {
    const int left = static_cast<int>(k) % mColumns * kTile, top = static_cast<int>(k) / mColumns * kTile;
    return {.left = left,
            .top = top,
            .width = std::min(kTile, mWidth - left),
            .height = std::min(kTile, mHeight - top),
            .splats = std::span(mSplats).subspan(mFirst[k], mFirst[k + 1] - mFirst[k])};
}

} // namespace curlew::detail
