// SPDX-License-Identifier: Apache-2.0
#include "LoopTable.h"

#include "curlew/base/Random.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/math/Fade.h"

#include <algorithm>

namespace curlew {

namespace {

constexpr double kMaxPace = 4.0 / 3;
constexpr double kFadeShare = 0.25;     // fraction of a particle's time in which it fades in, and out
constexpr uint64_t kFadeSeed = 0x10095; // separates these random numbers from others

Vec3d inDouble(const Vec3f& v) {
    Vec3d d;
    for (int axis = 0; axis < 3; ++axis) d[axis] = static_cast<double>(v[axis]);
    return d;
}

void addAccelerations(const Flow& flow, std::vector<LoopVertex>& vertices) {
    for (LoopVertex& vertex : vertices) {
        const FlowSample sample = flow.at(vertex.position);
        const Vec3d acceleration = sample.derivative * sample.velocity;
        for (int axis = 0; axis < 3; ++axis) vertex.acceleration[axis] = static_cast<float>(acceleration[axis]);
    }
}

/// Joins both parts of an open track in the order of time, up to `ahead`.
std::vector<LoopVertex> joined(const LoopLine& backward, const LoopLine& forward, double ahead) {
    std::vector<LoopVertex> vertices(backward.vertices.rbegin(), backward.vertices.rend());
    for (size_t k = vertices.empty() ? 0 : 1; k < forward.vertices.size(); ++k) {
        vertices.push_back(forward.vertices[k]);
        if (forward.vertices[k].time >= ahead) break;
    }
    return vertices;
}

/// Appends a track to the table.
void append(LoopTable& table, LoopPath path, const std::vector<LoopVertex>& vertices) {
    path.begin = static_cast<uint32_t>(table.vertices.size());
    path.count = static_cast<uint32_t>(vertices.size());
    table.vertices.insert(table.vertices.end(), vertices.begin(), vertices.end());
    table.paths.push_back(path);
}

void appendClosed(LoopTable& table, LoopPath path, const LoopLine& line, double duration) {
    path.kind = LoopKind::closed;
    path.end = line.end;
    path.gap = line.gap;
    path.coarse = static_cast<uint32_t>(line.coarse);
    path.period = line.vertices.back().time;
    path.rounds = std::max(1.0, std::round(duration / path.period));
    append(table, path, line.vertices);
}

void appendFading(LoopTable& table, LoopPath path, const LoopLine& backward, const LoopLine& forward, double ahead) {
    const std::vector<LoopVertex> vertices = joined(backward, forward, ahead);
    path.end = forward.vertices.back().time >= ahead ? backward.end : forward.end;
    path.coarse = static_cast<uint32_t>(forward.coarse + backward.coarse);
    path.first = vertices.front().time;
    path.last = std::min(ahead, vertices.back().time);
    path.kind = path.first < path.last ? LoopKind::fading : LoopKind::still;
    append(table, path, vertices);
}

} // namespace

LoopPlace placeOn(const LoopPath& path, double phase, double duration) {
    if (path.kind == LoopKind::still) return {};
    if (path.kind == LoopKind::closed) {
        const double round = path.rounds * phase;
        return {.time = (round - std::floor(round)) * path.period};
    }
    double time = phase * duration;
    if (time > path.last) time = time - duration >= path.first ? time - duration : path.last;
    const double part = (time - path.first) / (path.last - path.first);
    return {.time = time, .fade = static_cast<float>(quinticFade(std::min(part, 1 - part) / kFadeShare).value)};
}

size_t LoopTable::vertexAt(const LoopPath& path, double time) const {
    const auto first = vertices.begin() + path.begin, last = first + path.count;
    const auto after =
        std::upper_bound(first, last, time, [](double t, const LoopVertex& vertex) { return t < vertex.time; });
    return static_cast<size_t>((after == first ? first : after - 1) - vertices.begin());
}

Vec3d LoopTable::interpolate(size_t vertex, double time) const {
    const LoopVertex &a = vertices[vertex], &b = vertices[vertex + 1];
    const double h = b.time - a.time, s = (time - a.time) / h;
    const Vec3d v0 = inDouble(a.velocity) * h, v1 = inDouble(b.velocity) * h;
    const Vec3d a0 = inDouble(a.acceleration) * (h * h), a1 = inDouble(b.acceleration) * (h * h);
    // The error at the end of the parabola through the beginning: in position, velocity and acceleration.
    const Vec3d d = b.position - a.position - v0 - a0 * 0.5, e = v1 - v0 - a0, w = a1 - a0;
    const Vec3d c3 = d * 10.0 - e * 4.0 + w * 0.5, c4 = e * 7.0 - d * 15.0 - w, c5 = d * 6.0 - e * 3.0 + w * 0.5;
    return a.position + (v0 + (a0 * 0.5 + (c3 + (c4 + c5 * s) * s) * s) * s) * s;
}

LoopTable loopTable(const LoopSetup& setup, double duration, const Points& seeds, size_t begin, size_t end,
                    const Monitor& monitor) {
    const Flow& flow = setup.stepper.flow();
    std::array<bool, kBatch> allowed;
    const ActiveTipsN<3> tips = tipsAt(flow, batchOf(seeds, begin, end), allowed);

    const size_t count = end - begin;
    std::vector<LoopLine> forward(count), backward(count);
    LoopTracer ahead(setup, 1, forward), back(setup, -1, backward);
    for (size_t k = 0; k < count; ++k)
        if (allowed[k]) ahead.add(k, tips, static_cast<int>(k), kMaxPace * duration, true);
    ahead.run(monitor);
    // How long before the beginning of the loop a fading particle becomes visible.
    std::vector<double> earlier(count);
    for (size_t k = 0; k < count; ++k) {
        earlier[k] = duration * randomUniform(kFadeSeed, static_cast<uint64_t>(seeds.id[begin + k]));
        if (allowed[k] && forward[k].end != CurveEnd::closed) back.add(k, tips, static_cast<int>(k), earlier[k], false);
    }
    back.run(monitor);

    LoopTable table{.track = tips.track, .distance = tips.distance};
    for (size_t k = 0; k < count; ++k) {
        LoopPath path{.outside = !allowed[k]};
        if (!allowed[k])
            table.paths.push_back(path);
        else if (forward[k].end == CurveEnd::closed)
            appendClosed(table, path, forward[k], duration);
        else
            appendFading(table, path, backward[k], forward[k], duration - earlier[k]);
    }
    addAccelerations(flow, table.vertices);
    table.vertices.shrink_to_fit();
    return table;
}

} // namespace curlew
