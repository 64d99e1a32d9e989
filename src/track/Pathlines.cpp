// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/Pathlines.h"

#include "AdvectSteps.h"
#include "curlew/base/Memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace curlew {

namespace {

/// Returns curves of `vertices` vertices each, with values not yet set.
Curves unsetCurves(const Points& p, size_t vertices, bool tracks) {
    Curves c;
    const size_t all = p.size() * vertices;
    for (auto* array : {&c.x, &c.y, &c.z, &c.along}) array->resize(all);
    for (auto* array : {&c.vx, &c.vy, &c.vz}) array->resize(all);
    for (auto* array : {&c.f, &c.g}) array->resize(tracks ? all : 0);
    c.by = StepBy::time;
    for (size_t k = 1; k <= p.size(); ++k) c.start.push_back(k * vertices);
    c.id = p.id;
    c.upstream.assign(p.size(), CurveEnd::seed);
    c.downstream.assign(p.size(), CurveEnd::limit);
    c.length.assign(p.size(), 0);
    c.gap.assign(p.size(), 0);
    return c;
}

void record(const Points& p, size_t step, double time, Curves& c) {
    for (size_t k = 0; k < p.size(); ++k) {
        const size_t v = c.start[k] + step;
        c.x[v] = p.x[k], c.y[v] = p.y[k], c.z[v] = p.z[k];
        c.vx[v] = p.vx[k], c.vy[v] = p.vy[k], c.vz[v] = p.vz[k];
        if (c.hasTrack()) c.f[v] = p.f[k], c.g[v] = p.g[k];
        c.along[v] = time;
        if (step > 0) c.length[k] += length(c.position(v) - c.position(v - 1));
    }
}

} // namespace

Pathlines advectWithPathlines(const FlowInTime& flow, Points& particles, double begin, const AdvectOptions& options,
                              const Monitor& monitor) {
    if (options.steps < 0) throw ValueError(fmt::format("{} steps; give at least 1", options.steps));
    const int segments = options.steps > 0 ? options.steps : kMoments;
    const auto vertices = static_cast<size_t>(segments) + 1;
    requireMemory(static_cast<double>(particles.size()) * static_cast<double>(vertices) * Curves::kVertexBytes,
                  fmt::format("the pathlines of {} points with {} vertices each", particles.size(), vertices),
                  "move fewer points, or take fewer steps");
    const Flow first = flow.at(begin);
    const Monitor unreported = monitor.quiet();
    const AdvectOptions one = detail::oneOf(segments, detail::withAccuracy(options, first.domain()));
    AdvectOptions none = one;
    none.time = 0;
    const size_t overrun = detail::takeNewbornBack(flow, particles, begin, options, unreported);
    advect(flow, particles, begin, none, unreported); // sets velocity and track at the start
    Pathlines pathlines{.curves = unsetCurves(particles, vertices, particles.hasTrack()), .result = {}};
    pathlines.result.overrun = overrun;
    record(particles, 0, 0, pathlines.curves);
    for (int k = 0; k < segments; ++k) {
        pathlines.result += detail::advectPart(flow, particles, begin + one.time * k, one, options.time, unreported);
        record(particles, static_cast<size_t>(k) + 1, one.time * (k + 1), pathlines.curves);
        if (monitor.report) monitor.report((k + 1.0) / segments);
    }
    return pathlines;
}

} // namespace curlew
