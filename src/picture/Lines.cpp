// SPDX-License-Identifier: Apache-2.0
#include "curlew/picture/Lines.h"

#include "curlew/base/Error.h"
#include "curlew/math/Vec.h"
#include "curlew/picture/ColorMap.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace curlew {

namespace {

struct Point {
    double x, y;
};

/// Four neighbouring values, clockwise from the upper left, and their positions.
struct Cell {
    std::array<double, 4> value;
    std::array<Point, 4> corner;

    /// Returns where the level crosses the edge after corner a.
    Point crossing(size_t a, double level) const {
        const size_t b = (a + 1) % 4;
        const double t = (level - value[a]) / (value[b] - value[a]);
        return {std::lerp(corner[a].x, corner[b].x, t), std::lerp(corner[a].y, corner[b].y, t)};
    }

    void addLines(double level, std::vector<Segment>& lines) const {
        std::array<size_t, 4> edges{};
        size_t count = 0;
        for (size_t a = 0; a < 4; ++a)
            if ((value[a] >= level) != (value[(a + 1) % 4] >= level)) edges[count++] = a;
        const auto add = [&](size_t a, size_t b) {
            const Point p = crossing(a, level), q = crossing(b, level);
            lines.push_back({p.x, p.y, q.x, q.y});
        };
        if (count == 2) add(edges[0], edges[1]);
        if (count < 4) return;
        // In a saddle, the value at the middle decides which corners are connected.
        const double middle = 0.25 * (value[0] + value[1] + value[2] + value[3]);
        const bool joined = (middle >= level) == (value[0] >= level);
        add(0, joined ? 1 : 3);
        add(2, joined ? 3 : 1);
    }
};

/// Returns how much of a pixel a line covers whose centre line passes at this distance.
float coverage(double distance, double width) {
    return static_cast<float>(std::clamp(0.5 * width + 0.5 - distance, 0.0, std::min(width, 1.0)));
}

double distanceTo(const Segment& s, double x, double y) {
    const double dx = s.x1 - s.x0, dy = s.y1 - s.y0, squared = dx * dx + dy * dy;
    const double t = squared > 0 ? std::clamp(((x - s.x0) * dx + (y - s.y0) * dy) / squared, 0.0, 1.0) : 0;
    return length(Vec<double, 2>{{x - s.x0 - t * dx, y - s.y0 - t * dy}});
}

void cover(const Segment& s, double width, Image& mask) {
    const double reach = 0.5 * width + 1;
    const auto pixels = [&](double a, double b, int size) {
        const auto bounded = [&](double p) { return static_cast<int>(std::clamp(p, 0.0, static_cast<double>(size))); };
        return std::pair(bounded(std::min(a, b) - reach), bounded(std::max(a, b) + reach + 1));
    };
    if (!std::isfinite(s.x0 + s.y0 + s.x1 + s.y1)) return;
    const auto [left, right] = pixels(s.x0, s.x1, mask.width);
    const auto [top, bottom] = pixels(s.y0, s.y1, mask.height);
    for (int y = top; y < bottom; ++y)
        for (int x = left; x < right; ++x) {
            float& pixel = mask.at(x, y);
            pixel = std::max(pixel, coverage(distanceTo(s, x + 0.5, y + 0.5), width));
        }
}

/// Adds a shaft and a head of two strokes, centred at (x, y).
void addArrow(double x, double y, double dx, double dy, std::vector<Segment>& lines) {
    constexpr double kHead = 0.32, kSpread = 0.55; // relative to the arrow's length; relative to the head's
    const Point tip{x + dx / 2, y + dy / 2};
    lines.push_back({x - dx / 2, y - dy / 2, tip.x, tip.y});
    for (const double side : {-kSpread, kSpread})
        lines.push_back({tip.x, tip.y, tip.x - kHead * (dx - side * dy), tip.y - kHead * (dy + side * dx)});
}

} // namespace

std::vector<Segment> isoLines(const Image& scalar, std::span<const double> levels) {
    checkImage(scalar);
    if (scalar.channels.size() != 1) throw ValueError("iso-lines need an image with one channel");
    std::vector<Segment> lines;
    for (int y = 0; y + 1 < scalar.height; ++y)
        for (int x = 0; x + 1 < scalar.width; ++x) {
            Cell cell{};
            constexpr std::array<std::pair<int, int>, 4> around{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
            for (size_t k = 0; k < 4; ++k) {
                const auto [i, j] = around[k];
                cell.value[k] = static_cast<double>(scalar.at(x + i, y + j));
                cell.corner[k] = {x + i + 0.5, y + j + 0.5};
            }
            const auto [least, most] = std::minmax_element(cell.value.begin(), cell.value.end());
            if (!std::all_of(cell.value.begin(), cell.value.end(), [](double v) { return std::isfinite(v); })) continue;
            for (const double level : levels)
                if (level >= *least && level <= *most) cell.addLines(level, lines);
        }
    return lines;
}

std::vector<double> evenLevels(double lower, double upper, int count) {
    std::vector<double> levels;
    for (int k = 1; k <= count; ++k) levels.push_back(std::lerp(lower, upper, k / (count + 1.0)));
    return levels;
}

std::vector<Segment> contours(const Image& scalar, int count) {
    const ColorScale range = automaticScale(scalar, ColorMap::diverging);
    return isoLines(scalar, evenLevels(static_cast<double>(range.lower), static_cast<double>(range.upper), count));
}

std::vector<Segment> arrows(const Image& vectors, int across, double reference) {
    checkImage(vectors);
    if (vectors.channels.size() != 2) throw ValueError("arrows need an image with two channels");
    if (across < 1) throw ValueError(fmt::format("{} arrows in a row; give at least 1", across));
    const double cell = static_cast<double>(vectors.width) / across;
    const int down = std::max(1, static_cast<int>(std::lround(vectors.height / cell)));
    const double first = 0.5 * (vectors.height - (down - 1) * cell);
    struct Arrow {
        double x, y, dx, dy;
    };
    std::vector<Arrow> found;
    double longest = 0;
    for (int j = 0; j < down; ++j)
        for (int i = 0; i < across; ++i) {
            const double x = (i + 0.5) * cell, y = first + j * cell;
            const auto column = std::clamp(static_cast<int>(x), 0, vectors.width - 1),
                       row = std::clamp(static_cast<int>(y), 0, vectors.height - 1);
            const auto dx = static_cast<double>(vectors.at(column, row, 0)),
                       dy = -static_cast<double>(vectors.at(column, row, 1));
            if (!std::isfinite(dx) || !std::isfinite(dy)) continue;
            longest = std::max(longest, length(Vec<double, 2>{{dx, dy}}));
            found.push_back({x, y, dx, dy});
        }
    const double scale = 0.9 * cell / (reference > 0 ? reference : longest);
    std::vector<Segment> lines;
    for (const Arrow& a : found)
        if (constexpr double kVisible = 1; length(Vec<double, 2>{{a.dx, a.dy}}) * scale > kVisible)
            addArrow(a.x, a.y, a.dx * scale, a.dy * scale, lines);
    return lines;
}

void drawLines(Image& picture, const std::vector<Segment>& lines, const LineStyle& style) {
    Image mask = filledImage(picture.width, picture.height, {"coverage"});
    for (const Segment& line : lines) cover(line, style.width, mask);
    for (int y = 0; y < picture.height; ++y)
        for (int x = 0; x < picture.width; ++x)
            if (const float part = style.opacity * mask.at(x, y); part > 0)
                for (int channel = 0; channel < 3; ++channel)
                    picture.at(x, y, channel) = std::lerp(picture.at(x, y, channel), style.color[channel], part);
}

} // namespace curlew
