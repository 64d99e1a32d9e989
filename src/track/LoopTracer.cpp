// SPDX-License-Identifier: Apache-2.0
#include "LoopTracer.h"

#include <algorithm>

namespace curlew {

namespace {

/// Maximum gap of a return, relative to the chord of the step. Because f and g hold both ends to the same track,
/// whatever comes this close is closed.
constexpr double kClosure = 1e-3;
/// The cosine of the maximum turn of a step, 1 rad. A larger turn could miss the plane through the seed.
constexpr double kMinCosine = 0.54;

} // namespace

LoopVertex loopVertex(const Vec3d& position, const Vec3d& velocity, double time) {
    LoopVertex vertex{position, time, {}, {}};
    for (int axis = 0; axis < 3; ++axis) vertex.velocity[axis] = static_cast<float>(velocity[axis]);
    return vertex;
}

void LoopTracer::add(size_t line, const ActiveTipsN<3>& seeds, int seed, double limit, bool closes) {
    LoopLine& l = mLines[line];
    const Vec3d position = seeds.position[seed], velocity = seeds.velocity[seed];
    const double speed = length(velocity);
    l.vertices = {loopVertex(position, velocity, 0)};
    l.end = speed > 0 ? CurveEnd::limit : CurveEnd::stagnation;
    if (!(speed > 0) || !(limit > 0)) return;
    int part = kWhole;
    while (part > 1 && stepOf(part) * speed > mSetup.firstChord) part /= 2;
    mTips.copy(mTips.position.size++, seeds, seed);
    mTipStates.push_back({line, part, limit, closes, {position, velocity * (mSign / speed)}});
}

void LoopTracer::run(const Monitor& monitor) {
    while (!mTipStates.empty()) {
        monitor.check();
        advance();
    }
}

void LoopTracer::advance() {
    std::array<double, kBatch> dt;
    for (size_t a = 0; a < mTipStates.size(); ++a)
        dt[a] = mSign * std::min(stepOf(mTipStates[a].part), timeLeft(mTipStates[a]));
    const StepResultN<3> step = mSetup.stepper(mTips, dt);
    int kept = 0;
    for (size_t a = 0; a < mTipStates.size(); ++a) {
        const auto i = static_cast<int>(a);
        if (!proceed(mTipStates[a], i, step, dt[a])) continue;
        if (kept != i) {
            mTips.copy(kept, mTips, i);
            mTipStates[static_cast<size_t>(kept)] = mTipStates[a];
        }
        ++kept;
    }
    mTips.position.size = kept;
    mTipStates.resize(static_cast<size_t>(kept));
}

bool LoopTracer::tooCoarse(int i, const StepResultN<3>& step) const {
    const Vec3d from = mTips.velocity[i], to = step.reprojected.velocity[i];
    return step.error[static_cast<size_t>(i)] > mSetup.accuracy ||
           dot(from, to) < kMinCosine * length(from) * length(to);
}

bool LoopTracer::proceed(TipState& tip, int i, const StepResultN<3>& step, double dt) {
    LoopLine& line = mLines[tip.line];
    const auto a = static_cast<size_t>(i);
    const bool coarse = tooCoarse(i, step);
    if (!step.accepted[a] || (coarse && tip.part > 1)) {
        if (tip.part == 1) {
            line.end = CurveEnd::stuck;
            return false;
        }
        do tip.part /= 2;
        while (tip.part > 1 && stepOf(tip.part) >= std::abs(dt)); // which the remaining time had shortened
        return true;
    }
    line.coarse += coarse;
    const double before = last(tip).time;
    if (tip.closes && line.vertices.size() > 3)
        if (const auto closure = closureOf(mSetup.stepper, mTips, i, step.position[i], dt, tip.origin, kClosure)) {
            LoopVertex seed = line.vertices.front();
            seed.time = before + closure->part;
            line.vertices.push_back(seed);
            line.gap = closure->gap;
            line.end = CurveEnd::closed;
            return false;
        }
    line.vertices.push_back(loopVertex(step.position[i], step.reprojected.velocity[i], before + dt));
    constexpr double kGrowth = 32, kSafety = 2; // the error grows by kGrowth if the length doubles
    if (step.error[a] * kGrowth * kSafety < mSetup.accuracy) tip.part = std::min(2 * tip.part, kWhole);
    mTips.position.set(i, step.position[i]);
    mTips.velocity.set(i, step.reprojected.velocity[i]);
    mTips.distance[a] = step.distance[a];
    line.end = line.vertices.size() >= mSetup.vertices ? CurveEnd::vertices : CurveEnd::limit;
    return line.end == CurveEnd::limit && timeLeft(tip) > 1e-12 * tip.limit;
}

} // namespace curlew
