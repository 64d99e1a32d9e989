#include "curlew/image/Slice.h"

#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace curlew {

namespace {

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
constexpr double kMargin = 0.04; // of the longer edge, around the box

/// How pixels map to positions.
struct Plane {
    int u, v, axis;
    double left, top, pixel, position;

    Vec3d at(double x, double y) const {
        Vec3d p;
        p[u] = left + pixel * x;
        p[v] = top - pixel * y;
        p[axis] = position;
        return p;
    }
};

} // namespace

Image slice(const Box& box, const SliceChannel& channel, std::string name, const SliceOptions& o,
            const Monitor& monitor) {
    if (!box.finite()) throw ValueError("the domain is infinite; give a box");
    if (o.width < 1 || o.width > 1 << 15) throw ValueError(fmt::format("width {} must be 1 to 32768 pixels", o.width));
    if (o.supersampling < 1 || o.supersampling > 16)
        throw ValueError(fmt::format("supersampling {} must be 1 to 16", o.supersampling));
    // Up is y where it can be, else z.
    const int u = o.axis == 0 ? 2 : 0, v = o.axis == 1 ? 2 : 1;
    const double margin = kMargin * std::max(box.size()[u], box.size()[v]);
    const double width = box.size()[u] + 2 * margin, height = box.size()[v] + 2 * margin;
    if (!(box.size()[u] > 0) || !(box.size()[v] > 0)) throw ValueError("the box is empty");
    const double rows = std::max(1.0, std::round(o.width * height / width));
    if (rows > 1 << 15) throw ValueError(fmt::format("{} pixels in height are too many; choose a smaller width", rows));

    requireMemory(o.width * rows * 4 * sizeof(float), fmt::format("a picture of {} x {} pixels", o.width, rows),
                  "choose a smaller width");

    Image image{.width = o.width, .height = static_cast<int>(rows), .channels = {std::move(name)}, .pixels = {}};
    image.pixels.resize(static_cast<size_t>(image.width) * static_cast<size_t>(image.height));
    const Plane plane{u, v, o.axis, box.lower[u] - margin, box.upper[v] + margin, width / o.width, o.position};
    const int n = o.supersampling;
    parallelFor(
        static_cast<size_t>(image.height), 1,
        [&](size_t row, size_t) {
            std::vector<float> samples(static_cast<size_t>(image.width * n * n));
            PointBatch points;
            size_t done = 0;
            const auto flush = [&] {
                std::array<float, kBatch> values;
                channel(points, values);
                std::copy_n(values.begin(), points.size, samples.begin() + static_cast<std::ptrdiff_t>(done));
                done += static_cast<size_t>(points.size);
                points.size = 0;
            };
            for (int x = 0; x < image.width; ++x)
                for (int i = 0; i < n; ++i)
                    for (int j = 0; j < n; ++j) {
                        points.push(plane.at(x + (j + 0.5) / n, static_cast<double>(row) + (i + 0.5) / n));
                        if (points.full()) flush();
                    }
            flush();
            for (int x = 0; x < image.width; ++x) {
                float sum = 0;
                int count = 0;
                for (int s = 0; s < n * n; ++s)
                    if (const float value =
                            samples[static_cast<size_t>(x) * static_cast<size_t>(n * n) + static_cast<size_t>(s)];
                        !std::isnan(value)) {
                        sum += value;
                        ++count;
                    }
                image.at(x, static_cast<int>(row)) = 2 * count > n * n ? sum / static_cast<float>(count) : kNothing;
            }
        },
        monitor);
    return image;
}

SliceChannel flowChannel(const Flow& flow, std::string_view name) {
    using Pick = float (*)(const Vec3f& velocity, float f, float g, double distance);
    static constexpr std::array<std::pair<std::string_view, Pick>, 7> kPicks{{
        {"speed", [](const Vec3f& c, float, float, double) { return length(c); }},
        {"vx", [](const Vec3f& c, float, float, double) { return c[0]; }},
        {"vy", [](const Vec3f& c, float, float, double) { return c[1]; }},
        {"vz", [](const Vec3f& c, float, float, double) { return c[2]; }},
        {"f", [](const Vec3f&, float f, float, double) { return f; }},
        {"g", [](const Vec3f&, float, float g, double) { return g; }},
        {"distance", [](const Vec3f&, float, float, double d) { return static_cast<float>(d); }},
    }};
    const auto* found =
        std::find_if(kPicks.begin(), kPicks.end(), [&](const auto& pick) { return pick.first == name; });
    if (found == kPicks.end())
        throw ValueError(fmt::format("a flow has no channel '{}'; choose speed, vx, vy, vz, f, g or distance", name));
    return [flow, pick = found->second](const PointBatch& points, std::array<float, kBatch>& values) {
        std::array<bool, kBatch> allowed;
        std::array<double, kBatch> distance;
        classify(flow.domain(), points, allowed, distance);
        Flow::Jets<float> potentials;
        VecBatch<float> velocity;
        flow.eval(points, potentials, velocity);
        for (int i = 0; i < points.size; ++i) {
            const auto k = static_cast<size_t>(i);
            const bool shown = allowed[k] && flow.domain().box.contains(points[i]);
            values[k] = shown ? pick(velocity[i], potentials[0].c[0][k], potentials[1].c[0][k], distance[k]) : kNothing;
        }
    };
}

} // namespace curlew
