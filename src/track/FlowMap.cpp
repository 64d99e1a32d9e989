// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/FlowMap.h"

#include "AdvectSteps.h"
#include "BatchAdvector.h"
#include "curlew/base/Require.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/track/AdvectParts.h"

#include <limits>
#include <utility>

namespace curlew {

namespace {

/// Returns the flow continued beyond its wall.
Flow onBothSides(const Flow& flow) {
    Domain domain = flow.domain();
    if (!domain.wall) return flow;
    domain.wall->side = Side::both;
    return flow.within(domain);
}

/// Moves points through each flow in turn, without reprojection.
void drift(const std::vector<Flow>& flows, const AdvectOptions& options, double first, std::vector<Vec3d>& points,
           const Monitor& monitor) {
    std::vector<GuardedStepper<3>> steppers;
    steppers.reserve(flows.size());
    for (const Flow& flow : flows)
        steppers.push_back(detail::advectionStepper(flow, options, {.method = Reprojection::none}));
    forEachBatch(
        points,
        [&](PointBatch& batch, size_t begin) {
            const PointBatch start = batch;
            for (const auto& stepper : steppers) {
                detail::BatchAdvector<3> advector(stepper, options, first, {batch});
                advector.run(monitor);
                batch = advector.parts().front().tips.position;
            }
            for (int i = 0; i < batch.size; ++i) // a NaN coordinate would spread to the others
                if (!std::isfinite(dot(start[i], start[i]))) batch.set(i, start[i]);
            storeBatch(batch, points, begin);
        },
        monitor);
}

} // namespace

FlowMap::FlowMap(FlowInTime flow, const FlowMapOptions& options) : mFlow(std::move(flow)), mOptions(options) {
    if (options.step != 0) requirePositive(options.step, "the time step");
}

int FlowMap::steps(double from, double to) const {
    const double frozen = mFlow.steady() ? std::numeric_limits<double>::infinity() : kFrozenSeconds;
    const double step = mOptions.step > 0 ? mOptions.step : frozen;
    return stepsOf(to - from, step);
}

AdvectOptions FlowMap::advectOptions(double time, int count, const Domain& domain) const {
    const bool unsaid = mOptions.accuracy == 0 && mOptions.step == 0;
    return {.time = time,
            .steps = count,
            .scheme = mOptions.scheme,
            .reprojection = mOptions.reprojection,
            .accuracy = unsaid ? defaultAccuracy(domain) : mOptions.accuracy};
}

FlowMapResult FlowMap::carry(std::vector<Vec3d>& points, double from, double to, const Monitor& monitor) const {
    FlowMapResult result{.points = points.size()};
    const int count = steps(from, to);
    if (count == 0 || points.empty()) return result;
    const Flow first = mFlow.at(from + 0.5 * (to - from) / count);
    if (first.hasTracks() || first.domain().wall) return follow(points, from, to, count, monitor);
    AdvectOptions options = advectOptions(to - from, count, first.domain());
    detail::validate(first, options);
    options.reprojection.method = Reprojection::none;
    // A steady flow with adaptive steps needs no division of the time.
    const int parts = mFlow.steady() && options.adaptive() ? 1 : count;
    options = detail::oneOf(parts, options);
    const double step = options.adaptive() ? firstStep(first, options.usedScheme(), options.accuracy) : 0;
    // The flows of this many steps stay in the L1 cache while a batch uses them.
    constexpr int kTogether = 256;
    std::vector<Flow> flows;
    for (int k = 0; k < parts; ++k) {
        flows.push_back(mFlow.at(from + (k + 0.5) * options.time));
        if (flows.size() < kTogether && k < parts - 1) continue;
        drift(flows, options, step, points, monitor);
        flows.clear();
    }
    return result;
}

FlowMapResult FlowMap::follow(std::vector<Vec3d>& points, double from, double to, int count,
                              const Monitor& monitor) const {
    const FlowInTime both = mFlow.steady() ? FlowInTime(onBothSides(mFlow.at(from)))
                                           : FlowInTime([this](double t) { return onBothSides(mFlow.at(t)); });
    Points p = Points::at(points);
    const AdvectResult result = advect(both, p, from, advectOptions(to - from, count, both.at(from).domain()), monitor);
    for (size_t k = 0; k < points.size(); ++k) points[k] = p.position(k);
    return {.points = points.size(), .stalled = result.notConverged, .overrun = result.overrun};
}

} // namespace curlew
