// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/Trace.h"

#include "Tracer.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Require.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/track/Advect.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace curlew {

namespace {

constexpr size_t kChunk = 32; // curves traced together

/// Returns the arc length of a curve between two vertices, from its directions there. Uses a circular arc, whose chord
/// is shorter by sin(t) / t for a turn of 2t. The error is fifth order.
double arcLength(const TraceVertex& a, const TraceVertex& b) {
    const double u = length(a.velocity), v = length(b.velocity), chord = length(b.position - a.position);
    if (!(u > 0) || !(v > 0)) return chord;
    const Vec3d half = (b.velocity * (1 / v) - a.velocity * (1 / u)) * 0.5; // of length sin(t)
    const double s2 = std::min(dot(half, half), 0.25);
    return chord * (1 + s2 * (1.0 / 6 + s2 * (3.0 / 40 + s2 * (5.0 / 112)))); // t / sin(t), by Taylor
}

/// The curves of one chunk, and sums over them.
struct Part {
    Curves curves;
    size_t retries = 0;
    std::array<double, 2> squares{}, max{}; // drift: sums of squares, and maxima
};

void append(Part& part, const TraceSetup& setup, int64_t id, TraceLine& forward, TraceLine& backward) {
    Curves& c = part.curves;
    const bool hasTracks = setup.stepper.flow().hasTracks();
    if (backward.end == CurveEnd::closed) forward = {};
    const bool hasForward = !forward.vertices.empty(), hasBackward = !backward.vertices.empty();
    // In flow order: the backward part reversed, then the forward part.
    std::vector<TraceVertex> vertices(backward.vertices.rbegin(), backward.vertices.rend());
    vertices.insert(vertices.end(), forward.vertices.begin() + (hasForward && hasBackward ? 1 : 0),
                    forward.vertices.end());
    const TraceLine& only = hasForward ? forward : backward;
    const bool closed = only.end == CurveEnd::closed;
    double total = 0;
    for (size_t k = 1; k < vertices.size(); ++k) total += arcLength(vertices[k - 1], vertices[k]);
    if (closed) total += arcLength(vertices.back(), vertices.front());
    for (const TraceVertex& v : vertices) {
        c.x.push_back(v.position[0]), c.y.push_back(v.position[1]), c.z.push_back(v.position[2]);
        c.vx.push_back(static_cast<float>(v.velocity[0]));
        c.vy.push_back(static_cast<float>(v.velocity[1]));
        c.vz.push_back(static_cast<float>(v.velocity[2]));
        c.along.push_back(v.along);
        if (!hasTracks) continue;
        c.f.push_back(v.potentials[0]), c.g.push_back(v.potentials[1]);
        for (size_t q = 0; q < 2; ++q) {
            const double drift = std::abs(v.potentials[q] - only.vertices.front().potentials[q]);
            part.squares[q] += drift * drift;
            part.max[q] = std::max(part.max[q], drift);
        }
    }
    c.start.push_back(c.x.size());
    c.id.push_back(id);
    const bool outside = vertices.empty();
    const auto ended = [&](const TraceLine& line) {
        if (outside) return CurveEnd::outside;
        if (closed) return CurveEnd::closed;
        return line.vertices.empty() ? CurveEnd::seed : line.end;
    };
    c.upstream.push_back(ended(backward));
    c.downstream.push_back(ended(forward));
    c.length.push_back(total);
    c.gap.push_back(only.gap);
}

Part traceChunk(const TraceSetup& setup, const Points& seeds, size_t begin, size_t end, const Monitor& monitor) {
    const Direction direction = setup.options.direction;
    const Flow& flow = setup.stepper.flow();
    std::array<bool, kBatch> allowed;
    const ActiveTipsN<3> tips = tipsAt(flow, batchOf(seeds, begin, end), allowed);

    Part part;
    std::vector<TraceLine> forward(end - begin), backward(end - begin);
    const auto run = [&](double sign, std::vector<TraceLine>& lines) {
        Tracer tracer(setup, sign, lines);
        for (size_t k = 0; k < lines.size(); ++k) {
            const auto i = static_cast<int>(k);
            if (allowed[k] && flow.domain().box.contains(tips.position[i]) && forward[k].end != CurveEnd::closed)
                tracer.add(k, tips, i);
        }
        part.retries += tracer.run(monitor);
    };
    if (direction != Direction::backward) run(1, forward);
    if (direction != Direction::forward) run(-1, backward);
    for (size_t k = 0; k < forward.size(); ++k) append(part, setup, seeds.id[begin + k], forward[k], backward[k]);
    return part;
}

/// Moves an array of all parts into one, in order. Frees that of each part as soon as it is copied.
template <class T>
std::vector<T> joined(std::vector<Part>& parts, std::vector<T> Curves::*array) {
    size_t size = 0;
    for (const Part& part : parts) size += (part.curves.*array).size();
    std::vector<T> all;
    all.reserve(size);
    for (Part& part : parts) {
        const std::vector<T> some = std::exchange(part.curves.*array, {});
        all.insert(all.end(), some.begin(), some.end());
    }
    return all;
}

/// Moves all parts into one, in order.
Curves joined(std::vector<Part>& parts) {
    size_t vertices = 0;
    for (const Part& part : parts) vertices += part.curves.vertices();
    requireMemory(static_cast<double>(vertices) * Curves::kVertexBytes, "the curves",
                  "trace fewer or shorter curves, or larger steps");
    Curves all;
    size_t before = 0;
    for (const Part& part : parts) {
        const std::vector<size_t>& start = part.curves.start;
        for (size_t k = 1; k < start.size(); ++k) all.start.push_back(before + start[k]);
        before += part.curves.vertices();
    }
    const auto join = [&](auto... arrays) { ((all.*arrays = joined(parts, arrays)), ...); };
    join(&Curves::x, &Curves::y, &Curves::z, &Curves::f, &Curves::g, &Curves::along, &Curves::length, &Curves::gap,
         &Curves::vx, &Curves::vy, &Curves::vz, &Curves::upstream, &Curves::downstream, &Curves::id);
    return all;
}

void summarize(TraceResult& result) {
    const Curves& c = result.curves;
    size_t traced = 0;
    for (size_t k = 0; k < c.size(); ++k) {
        ++result.ends[static_cast<size_t>(c.downstream[k])];
        result.lengthMean += c.length[k];
        result.lengthMax = std::max(result.lengthMax, c.length[k]);
        traced += c.start[k + 1] > c.start[k];
        if (c.downstream[k] == CurveEnd::outside) continue;
        if (!c.closed(k)) {
            ++result.ends[static_cast<size_t>(c.upstream[k])];
            continue;
        }
        result.gapRms += c.gap[k] * c.gap[k];
        result.gapMax = std::max(result.gapMax, c.gap[k]);
    }
    result.lengthMean /= static_cast<double>(std::max<size_t>(traced, 1));
    result.gapRms = std::sqrt(result.gapRms / static_cast<double>(std::max<size_t>(result.count(CurveEnd::closed), 1)));
}

void validate(const Flow& flow, const Points& seeds, const TraceOptions& o) {
    if (seeds.y.size() != seeds.size() || seeds.z.size() != seeds.size() || seeds.id.size() != seeds.size())
        throw ValueError("the seed arrays differ in length; give x, y, z and id for each seed");
    if (o.step != 0) requirePositive(o.step, "step");
    if (o.limit != 0) requirePositive(o.limit, "limit");
    requirePositive(o.turn, "turn");
    if (o.vertices < 2) throw ValueError(fmt::format("{} vertices; give at least 2", o.vertices));
    if (!(o.stagnation >= 0) || !std::isfinite(o.stagnation))
        throw ValueError(fmt::format("stagnation {} must be 0 or more", o.stagnation));
    if (!(o.closure >= 0) || !(o.closure <= 0.1))
        throw ValueError(fmt::format("closure {} must be between 0 and 0.1 of a step", o.closure));
    if (!(o.accuracy >= 0)) throw ValueError(fmt::format("accuracy {} must be positive", o.accuracy));
    o.reprojection.validate(flow.hasTracks());
}

TraceSetup setupOf(const Flow& flow, TraceOptions o, const Monitor& monitor) {
    const FlowRms rms = rmsOf(flow, monitor.quiet());
    const double unit = length(flow.domain().box.size()) / (o.by == StepBy::length ? 1 : rms.speed > 0 ? rms.speed : 1);
    if (o.step == 0) o.step = unit / 200;
    if (o.limit == 0) o.limit = unit * 8;
    requirePositive(o.step, "step"); // fails for a box without extent
    const Scheme scheme = o.by == StepBy::time || o.accuracy > 0 ? Scheme::dormandPrince : Scheme::rk4;
    if (o.accuracy == 0)
        o.accuracy = o.by == StepBy::time ? defaultAccuracy(flow.domain()) : std::numeric_limits<double>::infinity();
    const auto cosine = [](double angle) { return angle < 3.14 ? std::cos(angle) : -2; }; // larger angles are no limit
    return {{flow, o.by, scheme, inUnitsOf(rms, o.reprojection), StepGuard::forStreamlines(o.reprojection.method)},
            o,
            rms,
            cosine(o.turn),
            cosine(o.turn / 2)};
}

} // namespace

TraceResult trace(const Flow& flow, const Points& seeds, const TraceOptions& options, const Monitor& monitor) {
    validate(flow, seeds, options);
    const TraceSetup setup = setupOf(flow, options, monitor);
    const double steps = std::min(setup.options.limit / setup.options.step + 2, double(setup.options.vertices));
    std::vector<Part> parts((seeds.size() + kChunk - 1) / kChunk);
    parallelFor(
        seeds.size(), kChunk,
        [&](size_t begin, size_t end) {
            // An upper bound for this chunk, in addition to what others have allocated so far.
            requireMemory(static_cast<double>(end - begin) * 2 * steps * (sizeof(TraceVertex) + Curves::kVertexBytes),
                          "part of the curves", "trace fewer or shorter curves, or larger steps");
            parts[begin / kChunk] = traceChunk(setup, seeds, begin, end, monitor);
        },
        monitor);
    TraceResult result;
    for (const Part& part : parts) {
        result.retries += part.retries;
        for (size_t q = 0; q < 2; ++q) {
            result.driftRms[q] += part.squares[q];
            result.driftMax[q] = std::max(result.driftMax[q], part.max[q]);
        }
    }
    result.curves = joined(parts);
    result.curves.by = setup.options.by;
    const auto vertices = static_cast<double>(std::max<size_t>(result.curves.vertices(), 1));
    for (size_t q = 0; q < 2; ++q) {
        const double scale = setup.rms.potentials[q] > 0 ? 1 / setup.rms.potentials[q] : 0;
        result.driftRms[q] = std::sqrt(result.driftRms[q] / vertices) * scale;
        result.driftMax[q] *= scale;
    }
    summarize(result);
    return result;
}

} // namespace curlew
