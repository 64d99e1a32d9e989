// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/FlowAtWall.h"

#include "OntoWall.h"
#include "curlew/base/Random.h"
#include "curlew/field/ForEachBatch.h"

#include <algorithm>
#include <cmath>

namespace curlew {

namespace {

constexpr uint64_t kWallSeed = 0x7465726d73;

Vec3d randomPoint(const Box& box, uint64_t index) {
    Vec3d p = box.lower;
    for (int axis = 0; axis < 3; ++axis)
        p[axis] += box.size()[axis] * randomUniform(kWallSeed, index, static_cast<uint64_t>(axis));
    return p;
}

/// Returns up to `count` points of the wall, from the same candidates in the box at every call.
std::vector<Vec3d> pointsOfWall(const Wall& wall, const Box& box, size_t count, const Monitor& monitor) {
    constexpr size_t kMaxTries = 16; // rounds of `count` candidates; more if the wall is small in its box
    std::vector<Vec3d> found;
    for (size_t k = 0; k < kMaxTries && found.size() < count; ++k) {
        std::vector<std::optional<Vec3d>> onWall(count);
        parallelFor(
            count, 64,
            [&](size_t begin, size_t end) {
                for (size_t i = begin; i < end; ++i)
                    onWall[i] = detail::ontoWall(wall, box, randomPoint(box, k * count + i));
            },
            monitor);
        for (const auto& p : onWall)
            if (p && found.size() < count) found.push_back(*p);
    }
    return found;
}

/// Returns the maximum speed of the flow across the wall at these points of it.
double greatestFlux(const Flow& flow, const std::vector<Vec3d>& onWall) {
    double greatest = 0;
    for (size_t begin = 0; begin < onWall.size(); begin += kBatch) {
        const PointBatch points = batchOf(onWall, begin, std::min(onWall.size(), begin + kBatch));
        VecBatch<double> c;
        JetBatch<double, 1> d;
        flow.velocity(points, c);
        flow.domain().wall->sdf.distance.eval(points, d);
        for (int i = 0; i < points.size; ++i)
            greatest = std::max(greatest, std::abs(dot(c[i], d[i].gradient)) / length(d[i].gradient));
    }
    return greatest;
}

/// `speed`: the rms speed of the flow.
AtWall measured(const Flow& flow, double speed, const std::vector<Vec3d>& onWall) {
    const double flux = greatestFlux(flow, onWall);
    return {.speed = speed, .flux = speed > 0 ? flux / speed : 0};
}

} // namespace

AtWall flowAtWall(const Flow& flow, size_t samples, const Monitor& monitor) {
    const Domain& domain = flow.domain();
    if (!domain.wall) return {};
    return measured(flow, rmsOf(flow, monitor).speed, pointsOfWall(*domain.wall, domain.box, samples, monitor));
}

SumAtWall sumAtWall(const Flow& flow, size_t samples, const Monitor& monitor) {
    const Domain& domain = flow.domain();
    if (!domain.wall) return {};
    const std::vector<Vec3d> onWall = pointsOfWall(*domain.wall, domain.box, samples, monitor);
    const FlowRms rms = rmsOf(flow, monitor);
    SumAtWall sum{.whole = measured(flow, rms.speed, onWall), .terms = {}};
    for (size_t k = 0; k < rms.terms.size(); ++k)
        sum.terms.push_back(measured(Flow(flow.terms()[k], domain), rms.terms[k].speed, onWall));
    return sum;
}

} // namespace curlew
