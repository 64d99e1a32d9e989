// SPDX-License-Identifier: Apache-2.0
#include "Freezing.h"

#include "../flow/Samples.h"
#include "curlew/math/Percentile.h"
#include "curlew/track/WallMotion.h"

#include <algorithm>
#include <cmath>

namespace curlew::detail {

namespace {

constexpr int kMaxTimes = 64; ///< Relative to the minimum.
constexpr int kTries = 4;

std::vector<Vec3d> probesOf(const Domain& domain) {
    constexpr size_t kProbes = 256, kPart = 4096, kMax = 1 << 17;
    std::vector<Vec3d> probes;
    for (size_t begin = 0; begin < kMax && probes.size() < kProbes; begin += kPart)
        visitSamples(domain, begin, begin + kPart, [&](const PointBatch& points) {
            for (int i = 0; i < points.size && probes.size() < kProbes; ++i) probes.push_back(points[i]);
        });
    return probes;
}

void carry(const Flow& from, const Flow& to, double seconds, Points& points, const Monitor& monitor) {
    if (from.domain().wall && to.domain().wall)
        WallMotion(*from.domain().wall, *to.domain().wall, from.domain().box, seconds).carry(points, monitor);
}

/// Computes points after `count` frozen steps from `begin`.
class FrozenSteps {
  public:
    FrozenSteps(const FlowInTime& flow, const Flow& before, double begin, const AdvectOptions& options,
                const FlowRms& rms, const Monitor& monitor)
        : mFlow(flow), mBefore(before), mBegin(begin), mOptions(options), mRms(rms), mMonitor(monitor) {}

    Points operator()(const std::vector<Vec3d>& start, double step, int count) const {
        Points points = Points::at(start);
        AdvectOptions one = mOptions;
        one.time = step;
        one.steps = 1;
        one.byAge = false;
        one.accuracy /= 10; // so that the error measured is that of freezing
        Flow before = mBefore;
        for (int k = 0; k < count; ++k) {
            const Flow middle = mFlow.at(mBegin + step * (k + 0.5)), after = mFlow.at(mBegin + step * (k + 1));
            carry(before, middle, step / 2, points, mMonitor);
            points.f.clear();
            points.g.clear();
            advectKnowing(middle, mRms, points, one, mMonitor);
            carry(middle, after, step / 2, points, mMonitor);
            before = after;
        }
        return points;
    }

  private:
    const FlowInTime& mFlow;
    const Flow& mBefore;
    double mBegin;
    const AdvectOptions& mOptions;
    const FlowRms& mRms;
    const Monitor& mMonitor;
};

} // namespace

Freezing freezingOf(const FlowInTime& flow, const Flow& before, double begin, const AdvectOptions& options,
                    const FlowRms& rms, const Monitor& monitor) {
    const int least = options.steps > 0 ? options.steps : kMoments;
    if (!options.adaptive() || options.time == 0) return {.moments = least};
    const std::vector<Vec3d> probes = probesOf(before.domain());
    if (probes.empty()) return {.moments = least};
    const Monitor quiet = monitor.quiet();
    const FrozenSteps frozen(flow, before, begin, options, rms, quiet);
    Freezing freezing{.moments = least};
    const double most = std::min(1e9, static_cast<double>(least) * kMaxTimes);
    for (int k = 0; k < kTries; ++k) {
        const double step = options.time / freezing.moments;
        const Points whole = frozen(probes, step, 1), halves = frozen(probes, step / 2, 2);
        std::vector<double> errors;
        double sum = 0;
        for (size_t i = 0; i < probes.size(); ++i) {
            const double error = 4.0 / 3 * length(whole.position(i) - halves.position(i));
            if (!std::isfinite(error)) continue;
            errors.push_back(error);
            sum += error;
        }
        if (errors.empty()) return freezing;
        freezing.error = sum / static_cast<double>(errors.size()) * freezing.moments;
        const double relative = percentile(errors, 0.95, PercentileRank::lower) / options.accuracy;
        if (relative <= 1 || freezing.moments >= most) return freezing;
        // 10 % more than needed, so that the next try succeeds; at most eight times, because the order may not show
        // yet.
        const double more = std::min(1.1 * std::cbrt(relative), 8.0);
        freezing.moments = static_cast<int>(std::min(most, std::ceil(freezing.moments * more)));
    }
    return freezing;
}

} // namespace curlew::detail
