// SPDX-License-Identifier: Apache-2.0
#include "curlew/picture/Panels.h"

#include "Draw.h"
#include "curlew/base/Error.h"
#include "curlew/base/Memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace curlew {

using namespace draw;

namespace {

constexpr int kMaxPixels = 1 << 16; // along an edge

int columnsFor(size_t count, int wanted) {
    const int n = static_cast<int>(count);
    if (wanted > 0) return std::min(wanted, n);
    return n <= 3 ? n : static_cast<int>(std::ceil(std::sqrt(n)));
}

void validate(const std::vector<Image>& pictures, const PanelOptions& o) {
    if (pictures.empty()) throw ValueError("there are no pictures to arrange as panels");
    for (const Image& picture : pictures) {
        checkImage(picture);
        if (picture.channels != std::vector<std::string>{"R", "G", "B"})
            throw ValueError(fmt::format("panels need pictures with channels R, G, B; this one has {}",
                                         fmt::join(picture.channels, ", ")));
    }
    if (o.columns < 0) throw ValueError(fmt::format("{} columns; give 1 or more, or 0", o.columns));
    if (!o.labels.empty() && o.labels.size() != pictures.size())
        throw ValueError(fmt::format("there are {} labels for {} pictures", o.labels.size(), pictures.size()));
}

/// Returns where the columns or rows begin, each with a gap before it; the last value is their end.
std::vector<int64_t> begins(const std::vector<int>& sizes, int gap) {
    std::vector<int64_t> begin{gap};
    for (const int size : sizes) begin.push_back(begin.back() + size + gap);
    return begin;
}

} // namespace

Image panels(const std::vector<Image>& pictures, const PanelOptions& o) {
    validate(pictures, o);
    const int columns = columnsFor(pictures.size(), o.columns);
    const int rows = (static_cast<int>(pictures.size()) + columns - 1) / columns;
    std::vector<int> widths(static_cast<size_t>(columns)), heights(static_cast<size_t>(rows));
    const auto column = [&](size_t k) { return k % static_cast<size_t>(columns); };
    const auto row = [&](size_t k) { return k / static_cast<size_t>(columns); };
    for (size_t k = 0; k < pictures.size(); ++k) {
        widths[column(k)] = std::max(widths[column(k)], pictures[k].width);
        heights[row(k)] = std::max(heights[row(k)], pictures[k].height);
    }

    // At a width of 1000 pixels, letters are 14 pixels high.
    const int64_t whole = std::accumulate(widths.begin(), widths.end(), int64_t{0});
    const int gap = o.gap >= 0 ? o.gap : std::max(2, static_cast<int>(whole / 100));
    int size = static_cast<int>(std::clamp<int64_t>((whole + 250) / 500, 1, 16));
    for (size_t k = 0; k < o.labels.size(); ++k)
        while (size > 1 && textWidth(o.labels[k]) * size > widths[column(k)]) --size;
    const int band = o.labels.empty() ? 0 : (kGlyphHeight + 3) * size;
    for (int& height : heights) height += band;

    const auto lefts = begins(widths, gap), tops = begins(heights, gap);
    if (lefts.back() > kMaxPixels || tops.back() > kMaxPixels)
        throw ValueError(fmt::format("panels of {} x {} pixels are too large; an edge can have at most {}",
                                     lefts.back(), tops.back(), kMaxPixels));
    const auto width = static_cast<int>(lefts.back()), height = static_cast<int>(tops.back());
    requireMemory(static_cast<double>(width) * height * 3 * sizeof(float),
                  fmt::format("panels of {} x {} pixels", width, height), "make the pictures smaller");
    Image sheet = filledImage(width, height, {"R", "G", "B"});
    fill(sheet, {0, 0, width, height}, kPaper);
    for (size_t k = 0; k < pictures.size(); ++k) {
        const Image& picture = pictures[k];
        const auto left = static_cast<int>(lefts[column(k)]), top = static_cast<int>(tops[row(k)]);
        const int across = widths[column(k)];
        paste(picture, left + (across - picture.width) / 2, top + band, sheet);
        if (o.labels.empty()) continue;
        const std::string label = fitted(o.labels[k], across / size);
        drawText(sheet, label, left + (across - textWidth(label) * size) / 2, top + size, size);
    }
    return sheet;
}

} // namespace curlew
