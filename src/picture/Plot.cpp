// SPDX-License-Identifier: Apache-2.0
#include "curlew/picture/Plot.h"

#include "curlew/base/Csv.h"
#include "curlew/base/Error.h"
#include "curlew/base/Text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

namespace curlew {

namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

// Axes.

/// The range of an axis, in values or their logarithms, and its ends in the picture.
struct Axis {
    bool log = false;
    double lower = 0, upper = 1, from = 0, to = 1;

    double scaled(double value) const {
        if (!log) return value;
        return value > 0 ? std::log10(value) : kMissing;
    }
    double at(double value) const { return from + (scaled(value) - lower) / (upper - lower) * (to - from); }
};

void include(Axis& axis, const std::vector<double>& values, bool& any) {
    for (const double value : values) {
        const double v = axis.scaled(value);
        if (!std::isfinite(v)) continue;
        axis.lower = any ? std::min(axis.lower, v) : v;
        axis.upper = any ? std::max(axis.upper, v) : v;
        any = true;
    }
}

void widen(Axis& axis, double part) {
    // Ticks within a few rounding errors of each other would have the same labels.
    constexpr double kConstant = 1e-12;
    if (axis.upper - axis.lower <= kConstant * std::max(std::abs(axis.lower), std::abs(axis.upper))) {
        const double half = axis.lower == 0 || axis.log ? 0.5 : std::abs(axis.lower) / 2;
        axis.lower -= half;
        axis.upper += half;
    }
    const double more = part * (axis.upper - axis.lower);
    // Do not extend below zero if no value is negative.
    axis.lower = !axis.log && axis.lower >= 0 && axis.lower - more < 0 ? 0 : axis.lower - more;
    axis.upper += more;
}

struct Tick {
    double value;
    std::string label;
};

/// Returns ticks at multiples of 1, 2 or 5 times a power of ten. On a logarithmic axis they are decades, and also 2 and
/// 5 times decades if the axis spans few of them.
std::vector<Tick> ticksOf(const Axis& axis) {
    std::vector<Tick> ticks;
    const double size = axis.upper - axis.lower;
    if (axis.log) {
        const bool dense = size < 2;
        const int by = std::max(1, static_cast<int>(std::ceil(size / 10)));
        for (int decade = static_cast<int>(std::floor(axis.lower)); decade <= std::ceil(axis.upper); decade += by)
            for (const double factor : {1.0, 2.0, 5.0}) {
                const double value = factor * std::pow(10, decade);
                if ((factor > 1 && !dense) || !(std::log10(value) >= axis.lower && std::log10(value) <= axis.upper))
                    continue;
                ticks.push_back({value, fmt::format("{:g}", value)});
            }
        if (ticks.size() > 1) return ticks;
        ticks.clear();
        for (const double end : {axis.lower, axis.upper})
            ticks.push_back({std::pow(10, end), fmt::format("{:.3g}", std::pow(10, end))});
        return ticks;
    }
    const double rough = size / 6, power = std::pow(10, std::floor(std::log10(rough)));
    const double step = power * (rough / power < 1.5 ? 1 : rough / power < 3.5 ? 2 : rough / power < 7.5 ? 5 : 10);
    const double first = std::ceil(axis.lower / step - 1e-9);
    constexpr int kMost = 12; // the step is at least size / 10.5
    for (int n = 0; n < kMost && (first + n) * step <= axis.upper + 1e-9 * size; ++n)
        ticks.push_back({(first + n) * step, fmt::format("{:.6g}", (first + n) * step + 0.0)});
    return ticks;
}

// Drawing.

/// Colours that are distinguishable with any colour vision (Okabe and Ito 2008).
constexpr std::array<std::string_view, 7> kColors{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                  "#e69f00", "#56b4e9", "#333333"};

std::string escaped(std::string_view text) {
    std::string out;
    for (const char c : printable(text)) {
        if (c == '&')
            out += "&amp;";
        else if (c == '<')
            out += "&lt;";
        else if (c == '>')
            out += "&gt;";
        else
            out += c;
    }
    return out;
}

std::string textAt(double x, double y, std::string_view anchor, std::string_view content, std::string_view more = "") {
    return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\"{}>{}</text>\n", x, y, anchor, more,
                       escaped(content));
}

std::string lineAt(double x0, double y0, double x1, double y1, std::string_view color) {
    return fmt::format("<path d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}\" stroke=\"{}\"/>\n", x0, y0, x1, y1, color);
}

std::string drawAxes(const Axis& x, const Axis& y, const PlotOptions& o, const std::string& xLabel) {
    std::string svg;
    for (const Tick& tick : ticksOf(x)) {
        svg += lineAt(x.at(tick.value), y.from, x.at(tick.value), y.to, "#dddddd");
        svg += textAt(x.at(tick.value), y.from + 18, "middle", tick.label);
    }
    for (const Tick& tick : ticksOf(y)) {
        svg += lineAt(x.from, y.at(tick.value), x.to, y.at(tick.value), "#dddddd");
        svg += textAt(x.from - 7, y.at(tick.value) + 4, "end", tick.label);
    }
    svg += lineAt(x.from, y.from, x.to, y.from, "#333333") + lineAt(x.from, y.from, x.from, y.to, "#333333");
    const double middleX = 0.5 * (x.from + x.to), middleY = 0.5 * (y.from + y.to);
    svg += textAt(middleX, o.height - 12, "middle", xLabel);
    svg += textAt(16, middleY, "middle", o.yLabel, fmt::format(" transform=\"rotate(-90 16 {:.1f})\"", middleY));
    return svg + textAt(middleX, 24, "middle", o.title, " font-size=\"16\"");
}

/// The colour of curve k, and its line: solid for the first curves, dashed once the colours repeat.
struct Pen {
    std::string_view color, dashes;
    explicit Pen(size_t k)
        : color(kColors[k % kColors.size()]), dashes(k < kColors.size() ? "" : " stroke-dasharray=\"5 4\"") {}
};

/// Draws a curve, interrupted where a value is missing. Points get markers if they are few, or if both of their
/// neighbours are missing.
std::string drawCurve(const PlotData& data, const PlotData::Curve& curve, const Axis& x, const Axis& y,
                      const Pen& pen) {
    std::string path, markers, lone;
    const auto shown = [&](size_t k) {
        return k < data.x.size() && std::isfinite(x.at(data.x[k])) && std::isfinite(y.at(curve.y[k]));
    };
    bool down = false;
    size_t count = 0;
    for (size_t k = 0; k < data.x.size(); ++k) {
        const bool here = shown(k);
        if (here) {
            const double px = x.at(data.x[k]), py = y.at(curve.y[k]);
            path += fmt::format("{}{:.2f} {:.2f}", down ? 'L' : 'M', px, py);
            const std::string marker =
                fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"3\" fill=\"{}\"/>\n", px, py, pen.color);
            markers += marker;
            if (!down && !shown(k + 1)) lone += marker;
            ++count;
        }
        down = here;
    }
    constexpr size_t kFew = 40;
    return fmt::format("<path d=\"{}\" stroke=\"{}\" stroke-width=\"2\" stroke-linejoin=\"round\"{}/>\n{}", path,
                       pen.color, pen.dashes, count <= kFew ? markers : lone);
}

void validate(const PlotData& data, const PlotOptions& o) {
    if (o.width < 200 || o.height < 200 || o.width > 10000 || o.height > 10000)
        throw ValueError(
            fmt::format("a plot of {} x {} pixels; width and height must be 200 to 10000", o.width, o.height));
    for (const auto& curve : data.curves)
        if (curve.y.size() != data.x.size())
            throw ValueError(fmt::format("the curve '{}' has {} values for {} values of x", curve.name, curve.y.size(),
                                         data.x.size()));
}

} // namespace

PlotData readPlotData(const std::filesystem::path& path) {
    const CsvTable table = readCsv(path, CsvCells::optional, [&](const std::vector<std::string>& names) {
        if (names.size() < 2)
            throw FileError(fmt::format("cannot read '{}': its header needs a name for x and for at least one curve",
                                        path.string()));
    });
    if (table.values.empty()) throw FileError(fmt::format("cannot read '{}': it has no numbers", path.string()));
    PlotData data{.xName = table.names[0]};
    for (size_t k = 1; k < table.names.size(); ++k) data.curves.push_back({.name = table.names[k]});
    for (size_t k = 0; k < table.values.size(); ++k) {
        const size_t column = k % table.names.size();
        (column == 0 ? data.x : data.curves[column - 1].y).push_back(table.values[k]);
    }
    return data;
}

std::string plotSvg(const PlotData& data, const PlotOptions& o) {
    validate(data, o);
    size_t longest = 0;
    for (const auto& curve : data.curves) longest = std::max(longest, curve.name.size());
    const double legend =
        data.curves.size() > 1 ? std::min(45 + 7.0 * static_cast<double>(longest), o.width / 3.0) : 16;
    Axis x{.log = o.logX, .from = 78, .to = o.width - legend - 8}, y{.log = o.logY, .from = o.height - 58.0, .to = 42};
    bool anyX = false, anyY = false;
    include(x, data.x, anyX);
    for (const auto& curve : data.curves) include(y, curve.y, anyY);
    if (!anyX || !anyY)
        throw ValueError(o.logX || o.logY ? "the plot would be empty: no positive values for a logarithmic axis"
                                          : "the plot would be empty: there are no values");
    widen(x, 0);
    widen(y, 0.04);

    std::string svg = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 "
        "{0} {1}\" font-family=\"sans-serif\" font-size=\"12\" fill=\"none\">\n"
        "<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n<g fill=\"#222222\">\n",
        o.width, o.height);
    svg += drawAxes(x, y, o, o.xLabel.empty() ? data.xName : o.xLabel) + "</g>\n";
    for (size_t k = 0; k < data.curves.size(); ++k) {
        const Pen pen(k);
        svg += drawCurve(data, data.curves[k], x, y, pen);
        if (data.curves.size() < 2) continue;
        const double row = y.to + 8 + 19 * static_cast<double>(k);
        svg += fmt::format("<path d=\"M{0:.1f} {1:.1f}h18\" stroke=\"{2}\" stroke-width=\"3\"{3}/>\n", x.to + 12, row,
                           pen.color, pen.dashes);
        svg += textAt(x.to + 35, row + 4, "start", data.curves[k].name, " fill=\"#222222\"");
    }
    return svg + "</svg>\n";
}

} // namespace curlew
