// SPDX-License-Identifier: Apache-2.0
#include "Tracer.h"

#include <algorithm>

namespace curlew {

namespace {

/// Drops the last segment of a curve if it is shorter than this, relative to a step.
constexpr double kShort = 1e-3;

} // namespace

void Tracer::add(size_t line, const ActiveTipsN<3>& seeds, int seed) {
    TraceLine& l = mLines[line];
    const Vec3d position = seeds.position[seed], velocity = seeds.velocity[seed];
    const auto k = static_cast<size_t>(seed);
    l.vertices = {{position, velocity, {seeds.track[0][k], seeds.track[1][k]}, 0}};
    l.end = CurveEnd::stagnation;
    if (mSetup.stagnates(velocity)) return;
    mTips.copy(mTips.position.size++, seeds, seed);
    mTipStates.push_back({line, whole(), {position, velocity * (mSign / length(velocity))}});
}

size_t Tracer::run(const Monitor& monitor) {
    while (!mTipStates.empty()) {
        monitor.check();
        advance();
    }
    return mRetries;
}

void Tracer::advance() {
    const TraceOptions& o = mSetup.options;
    std::array<double, kBatch> dt;
    for (size_t a = 0; a < mTipStates.size(); ++a)
        dt[a] = mSign * std::min(o.step * mTipStates[a].part / whole(), o.limit - std::abs(last(mTipStates[a]).along));
    const StepResult step = mSetup.stepper(mTips, dt);
    int kept = 0;
    for (size_t a = 0; a < mTipStates.size(); ++a) {
        TipState& tip = mTipStates[a];
        const auto i = static_cast<int>(a);
        const bool refine = turns(step, i, mSetup.cosTurn) || step.error[a] > o.accuracy;
        if (!step.accepted[a] || (refine && tip.part > 1)) {
            if (tip.part == 1) {
                mLines[tip.line].end = CurveEnd::stuck;
                continue;
            }
            ++mRetries;
            tip.part /= 2;
        } else if (const auto end = acceptStep(tip, i, step, dt[a])) {
            mLines[tip.line].end = *end;
            continue;
        } else {
            // A step twice as long has 32 times the error; a further factor of 2 allows for what the estimate misses.
            if (!turns(step, i, mSetup.cosHalfTurn) && step.error[a] * 64 <= o.accuracy)
                tip.part = std::min(2 * tip.part, whole());
            mTips.position.set(i, step.position[i]);
            mTips.velocity.set(i, step.reprojected.velocity[i]);
            mTips.distance[a] = step.distance[a];
        }
        if (kept != i) {
            mTips.copy(kept, mTips, i);
            mTipStates[static_cast<size_t>(kept)] = tip;
        }
        ++kept;
    }
    mTips.position.size = kept;
    mTipStates.resize(static_cast<size_t>(kept));
}

bool Tracer::turns(const StepResult& step, int i, double cosine) const {
    const Vec3d from = mTips.velocity[i], to = step.reprojected.velocity[i];
    return dot(from, to) < cosine * length(from) * length(to);
}

std::optional<CurveEnd> Tracer::acceptStep(const TipState& tip, int i, const StepResult& step, double dt) {
    const TraceOptions& o = mSetup.options;
    if (closes(tip, i, step, dt)) return CurveEnd::closed;
    if (!mSetup.stepper.flow().domain().box.contains(step.position[i])) {
        leave(tip, i, step, dt);
        return CurveEnd::box;
    }
    push(tip, i, step, i, dt);
    if (mSetup.stagnates(step.reprojected.velocity[i])) return CurveEnd::stagnation;
    if (o.limit - std::abs(last(tip).along) <= 1e-9 * o.step) return CurveEnd::limit;
    if (mLines[tip.line].vertices.size() >= o.vertices) return CurveEnd::vertices;
    return {};
}

void Tracer::push(const TipState& tip, int i, const StepResult& step, int k, double dt) {
    TraceVertex vertex{step.position[k], step.reprojected.velocity[k], {}, last(tip).along + dt};
    for (size_t q = 0; q < 2; ++q)
        vertex.potentials[q] =
            mTips.track[q][static_cast<size_t>(i)] + step.reprojected.residual[q][static_cast<size_t>(k)];
    mLines[tip.line].vertices.push_back(vertex);
}

bool Tracer::closes(const TipState& tip, int i, const StepResult& step, double dt) {
    TraceLine& line = mLines[tip.line];
    if (mSetup.options.closure == 0 || line.vertices.size() < 3) return false;
    const auto closure = closureOf(mSetup.stepper, mTips, i, step.position[i], dt, tip.origin, mSetup.options.closure);
    if (!closure) return false;
    line.gap = closure->gap;
    const Vec3d from = mTips.position[i];
    if (length(from - tip.origin.position) < kShort * length(step.position[i] - from) && line.vertices.size() > 3)
        line.vertices.pop_back();
    return true;
}

void Tracer::leave(const TipState& tip, int i, const StepResult& step, double dt) {
    const Box& box = mSetup.stepper.flow().domain().box;
    const Vec3d from = mTips.position[i], to = step.position[i];
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
    auto landed = stepOnto(mSetup.stepper, mTips, i, point, normal, length(to - from), dt);
    if (!landed || !(std::abs(landed->part) > kShort * std::abs(dt))) return;
    Vec3d end = landed->result.position[0];
    end[axis] = place;
    if (!box.contains(end)) return;
    landed->result.position.set(0, end);
    push(tip, i, landed->result, 0, landed->part);
}

} // namespace curlew
