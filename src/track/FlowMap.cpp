#include "curlew/track/FlowMap.h"

#include "curlew/base/Parallel.h"
#include "curlew/base/Require.h"

#include <fmt/format.h>

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
    parallelFor(
        points.size(), kBatch,
        [&](size_t begin, size_t end) {
            PointBatch batch, next;
            for (size_t k = begin; k < end; ++k) batch.push(points[k]);
            for (const Flow& flow : flows) {
                monitor.check();
                const auto velocity = [&](const PointBatch& p, VecBatch<double>& v) { flow.velocity(p, v); };
                StagesN<3> stages;
                velocity(batch, stages[0]);
                step(scheme, batch, dts, velocity, stages, next);
                batch = next;
            }
            for (size_t k = begin; k < end; ++k) points[k] = batch[static_cast<int>(k - begin)];
        },
        monitor);
}

} // namespace

FlowMap::FlowMap(FlowInTime flow, const FlowMapOptions& options) : mFlow(std::move(flow)), mOptions(options) {
    requirePositive(options.step, "the time step");
}

int FlowMap::steps(double from, double to) const {
    constexpr double kMost = 1e9;
    const double count = std::ceil(std::abs(to - from) / mOptions.step - 1e-9);
    if (!(count <= kMost)) // NaN, too
        throw ValueError(
            fmt::format("from {} s to {} s in steps of {} s is impossible; give finite times, and at "
                        "most {:g} steps",
                        from, to, mOptions.step, kMost));
    return static_cast<int>(std::max(count, 0.0));
}

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
    Particles p;
    for (size_t k = 0; k < points.size(); ++k) {
        p.x.push_back(points[k][0]);
        p.y.push_back(points[k][1]);
        p.z.push_back(points[k][2]);
        p.id.push_back(static_cast<int64_t>(k));
    }
    const AdvectOptions options{.time = to - from,
                                .steps = count,
                                .scheme = mOptions.scheme,
                                .tolerance = mOptions.tolerance,
                                .iterations = mOptions.iterations,
                                .maxSubdivisions = mOptions.maxSubdivisions};
    const AdvectResult result = advect(both, p, from, options, monitor);
    for (size_t k = 0; k < points.size(); ++k) points[k] = {{p.x[k], p.y[k], p.z[k]}};
    return result.notConverged;
}

} // namespace curlew
