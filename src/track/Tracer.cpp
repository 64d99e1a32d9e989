#include "Tracer.h"

#include "ChordRule.h"
#include "curlew/track/Stepper.h"

#include <algorithm>

namespace curlew {

/// Where one step from each of them leads.
struct TraceLanding {
    PointBatch position;
    ReprojectedBatch track;
    std::array<double, kBatch> distance;
    std::array<bool, kBatch> taken;
};

namespace {

/// A last piece of a curve that is shorter than this, relative to a step, is left out.
constexpr double kShort = 1e-3;

TraceLanding attempt(const TraceSetup& setup, const TraceHeads& from, const std::array<double, kBatch>& dt) {
    StagesN<3> stages;
    for (int i = 0; i < from.position.size; ++i) stages.first.set(i, setup.paced(from.velocity[i]));
    TraceLanding landing;
    step(
        Scheme::rk4, from.position, dt, [&](const PointBatch& p, VecBatch<double>& v) { setup.pace.velocity(p, v); },
        stages, landing.position);
    std::array<double, kBatch> limit;
    for (int i = 0; i < from.position.size; ++i)
        limit[static_cast<size_t>(i)] = length(landing.position[i] - from.position[i]);
    const PointBatch stepped = landing.position;
    reproject(setup.flow, landing.position, from.track, limit, setup.reprojection, landing.track);
    std::array<bool, kBatch> allowed;
    classify(setup.flow.domain(), landing.position, allowed, landing.distance);
    const bool reprojects = setup.options.reprojection != Reprojection::none;
    for (int i = 0; i < from.position.size; ++i) {
        const auto k = static_cast<size_t>(i);
        const Vec3d p = landing.position[i];
        landing.taken[k] =
            std::isfinite(p[0] + p[1] + p[2]) && allowed[k] && (landing.distance[k] < 0) == (from.distance[k] < 0);
        // Near a point where the flow stands still, a correction can take back all that the step has gone.
        if (reprojects)
            landing.taken[k] =
                landing.taken[k] && landing.track.converged[k] && length(p - stepped[i]) <= 0.5 * limit[k];
    }
    checkChords(setup.flow.domain(), from.position, landing.position, from.distance, landing.taken);
    return landing;
}

} // namespace

void Tracer::add(size_t line, const TraceHeads& seeds, int seed) {
    TraceLine& l = mLines[line];
    const Vec3d position = seeds.position[seed], velocity = seeds.velocity[seed];
    const auto k = static_cast<size_t>(seed);
    l.vertices = {{position, velocity, {seeds.track[0][k], seeds.track[1][k]}, 0}};
    l.end = CurveEnd::stagnation;
    if (mSetup.stands(velocity)) return;
    mHeads.copy(mHeads.position.size++, seeds, seed);
    mLanes.push_back({line, whole(), position, velocity * (mSign / length(velocity))});
}

size_t Tracer::run(const Monitor& monitor) {
    while (!mLanes.empty()) {
        monitor.check();
        advance();
    }
    return mRetries;
}

void Tracer::advance() {
    const TraceOptions& o = mSetup.options;
    std::array<double, kBatch> dt;
    for (size_t a = 0; a < mLanes.size(); ++a)
        dt[a] = mSign * std::min(o.step * mLanes[a].part / whole(), o.limit - std::abs(last(mLanes[a]).along));
    const TraceLanding landing = attempt(mSetup, mHeads, dt);
    int kept = 0;
    for (size_t a = 0; a < mLanes.size(); ++a) {
        Lane& lane = mLanes[a];
        const auto i = static_cast<int>(a);
        if (!landing.taken[a] || (turns(landing, i, mSetup.cosTurn) && lane.part > 1)) {
            if (lane.part == 1) {
                mLines[lane.line].end = CurveEnd::stuck;
                continue;
            }
            ++mRetries;
            lane.part /= 2;
        } else if (const auto end = settle(lane, i, landing, dt[a])) {
            mLines[lane.line].end = *end;
            continue;
        } else {
            if (!turns(landing, i, mSetup.cosHalfTurn)) lane.part = std::min(2 * lane.part, whole());
            mHeads.position.set(i, landing.position[i]);
            mHeads.velocity.set(i, landing.track.velocity[i]);
            mHeads.distance[a] = landing.distance[a];
        }
        if (kept != i) {
            mHeads.copy(kept, mHeads, i);
            mLanes[static_cast<size_t>(kept)] = lane;
        }
        ++kept;
    }
    mHeads.position.size = kept;
    mLanes.resize(static_cast<size_t>(kept));
}

bool Tracer::turns(const TraceLanding& landing, int i, double cosine) const {
    const Vec3d from = mHeads.velocity[i], to = landing.track.velocity[i];
    return dot(from, to) < cosine * length(from) * length(to);
}

std::optional<CurveEnd> Tracer::settle(const Lane& lane, int i, const TraceLanding& landing, double dt) {
    const TraceOptions& o = mSetup.options;
    if (closes(lane, i, landing, dt)) return CurveEnd::closed;
    if (!mSetup.flow.domain().box.contains(landing.position[i])) {
        leave(lane, i, landing, dt);
        return CurveEnd::box;
    }
    push(lane, i, landing, i, dt);
    if (mSetup.stands(landing.track.velocity[i])) return CurveEnd::stagnation;
    if (o.limit - std::abs(last(lane).along) <= 1e-9 * o.step) return CurveEnd::limit;
    if (mLines[lane.line].vertices.size() >= o.vertices) return CurveEnd::vertices;
    return {};
}

void Tracer::push(const Lane& lane, int i, const TraceLanding& landing, int k, double dt) {
    TraceVertex vertex{landing.position[k], landing.track.velocity[k], {}, last(lane).along + dt};
    for (size_t q = 0; q < 2; ++q)
        vertex.potentials[q] =
            mHeads.track[q][static_cast<size_t>(i)] + landing.track.residual[q][static_cast<size_t>(k)];
    mLines[lane.line].vertices.push_back(vertex);
}

std::optional<std::pair<TraceLanding, double>> Tracer::landOn(int i, const Vec3d& point, const Vec3d& normal,
                                                              double chord, double dt) const {
    const TraceHeads one = mHeads.only(i);
    const double lower = std::min(dt, 0.0), upper = std::max(dt, 0.0);
    Vec3d position = one.position[0], velocity = one.velocity[0];
    double part = 0;
    for (int iteration = 0; iteration < 10; ++iteration) { // Newton's
        const double off = dot(normal, position - point);
        const double next = part - off / dot(normal, mSetup.paced(velocity));
        if (!std::isfinite(next)) return {};
        part = std::clamp(next, lower, upper);
        const TraceLanding landing = attempt(mSetup, one, {part});
        if (!landing.taken[0]) return {};
        position = landing.position[0], velocity = landing.track.velocity[0];
        if (std::abs(dot(normal, position - point)) <= 1e-10 * chord + 1e-15 * length(position))
            return std::pair(landing, part);
    }
    return {};
}

bool Tracer::closes(const Lane& lane, int i, const TraceLanding& landing, double dt) {
    TraceLine& line = mLines[lane.line];
    const Vec3d from = mHeads.position[i], to = landing.position[i];
    const double chord = length(to - from);
    if (mSetup.options.closure == 0 || line.vertices.size() < 3 || !(length(from - lane.seed) < 2 * chord) ||
        !(dot(lane.normal, from - lane.seed) < 0) || !(dot(lane.normal, to - lane.seed) >= 0))
        return false;
    const auto landed = landOn(i, lane.seed, lane.normal, chord, dt);
    if (!landed) return false;
    const double gap = length(landed->first.position[0] - lane.seed);
    if (!(gap <= mSetup.options.closure * chord)) return false;
    line.gap = gap;
    if (length(from - lane.seed) < kShort * chord && line.vertices.size() > 3) line.vertices.pop_back();
    return true;
}

void Tracer::leave(const Lane& lane, int i, const TraceLanding& landing, double dt) {
    const Box& box = mSetup.flow.domain().box;
    const Vec3d from = mHeads.position[i], to = landing.position[i];
    double first = std::numeric_limits<double>::infinity(), place = 0;
    int axis = 0;
    for (int k = 0; k < 3; ++k)
        for (const double face : {box.lower[k], box.upper[k]}) {
            const bool through = face == box.lower[k] ? to[k] < face : to[k] > face;
            const double fraction = (face - from[k]) / (to[k] - from[k]);
            if (through && fraction < first) first = fraction, place = face, axis = k;
        }
    Vec3d point, normal;
    point[axis] = place;
    normal[axis] = 1;
    auto landed = landOn(i, point, normal, length(to - from), dt);
    if (!landed || !(std::abs(landed->second) > kShort * std::abs(dt))) return;
    Vec3d end = landed->first.position[0];
    end[axis] = place;
    if (!box.contains(end)) return;
    landed->first.position.set(0, end);
    push(lane, i, landed->first, 0, landed->second);
}

} // namespace curlew
