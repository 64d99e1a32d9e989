#include "curlew/track/FlowMap.h"

#include "curlew/base/Require.h"
#include "curlew/field/ForEachBatch.h"

#include <utility>

namespace curlew {

namespace {

/// The flow as it goes on beyond its wall.
Flow onBothSides(const Flow& flow) {
    Domain domain = flow.domain();
    if (!domain.wall) return flow;
    domain.wall->side = Side::both;
    return flow.within(domain);
}

/// Moves points through one step of each flow in turn, without reprojection.
void drift(const std::vector<Flow>& flows, Scheme scheme, double dt, std::vector<Vec3d>& points,
           const Monitor& monitor) {
    std::array<double, kBatch> dts;
    dts.fill(dt);
    forEachBatch(
        points,
        [&](PointBatch& batch, size_t begin) {
            PointBatch next;
            for (const Flow& flow : flows) {
                monitor.check();
                const auto velocity = [&](const PointBatch& p, VecBatch<double>& v) { flow.velocity(p, v); };
                StagesN<3> stages;
                velocity(batch, stages[0]);
                step(scheme, batch, dts, velocity, stages, next);
                batch = next;
            }
            storeBatch(batch, points, begin);
        },
        monitor);
}

} // namespace

FlowMap::FlowMap(FlowInTime flow, const FlowMapOptions& options) : mFlow(std::move(flow)), mOptions(options) {
    requirePositive(options.step, "the time step");
}

int FlowMap::steps(double from, double to) const { return stepsOf(to - from, mOptions.step); }

FlowMapResult FlowMap::carry(std::vector<Vec3d>& points, double from, double to, const Monitor& monitor) const {
    FlowMapResult result{.points = points.size()};
    const int count = steps(from, to);
    if (count == 0 || points.empty()) return result;
    const double dt = (to - from) / count;
    const auto middle = [&](int k) { return mFlow.at(from + (k + 0.5) * dt); };
    if (middle(0).hasTracks()) {
        result.stalled = follow(points, from, to, count, monitor);
        return result;
    }
    // What a batch does in these steps stays in the first-level cache.
    constexpr int kTogether = 256;
    std::vector<Flow> flows;
    for (int k = 0; k < count; ++k) {
        flows.push_back(middle(k));
        if (flows.size() < kTogether && k < count - 1) continue;
        drift(flows, mOptions.scheme, dt, points, monitor);
        flows.clear();
    }
    return result;
}

size_t FlowMap::follow(std::vector<Vec3d>& points, double from, double to, int count, const Monitor& monitor) const {
    const FlowInTime both = mFlow.steady() ? FlowInTime(onBothSides(mFlow.at(from)))
                                           : FlowInTime([this](double t) { return onBothSides(mFlow.at(t)); });
    Points p = Points::at(points);
    const AdvectOptions options{
        .time = to - from, .steps = count, .scheme = mOptions.scheme, .reprojection = mOptions.reprojection};
    const AdvectResult result = advect(both, p, from, options, monitor);
    for (size_t k = 0; k < points.size(); ++k) points[k] = p.position(k);
    return result.notConverged;
}

} // namespace curlew
