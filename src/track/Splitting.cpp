// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/Splitting.h"

#include "OntoWall.h"
#include "curlew/base/Error.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/track/Scatter.h"

#include <algorithm>
#include <cmath>

namespace curlew {

namespace {

constexpr uint64_t kSeed = 0x7465726d73;

/// Appends the factors of a Strang step of `fraction` time steps. Merges consecutive factors of the same term.
void appendStrang(double fraction, size_t terms, std::vector<SplitFactor>& factors) {
    const auto append = [&](size_t term, double part) {
        if (!factors.empty() && factors.back().term == term)
            factors.back().fraction += part;
        else
            factors.push_back({term, part});
    };
    const size_t last = terms - 1;
    for (size_t k = 0; k < last; ++k) append(k, fraction / 2);
    append(last, fraction);
    for (size_t k = last; k-- > 0;) append(k, fraction / 2);
}

/// Returns up to `count` points of the wall, from the same candidates at every call.
std::vector<Vec3d> pointsOfWall(const Wall& wall, const Box& box, size_t count, const Monitor& monitor) {
    Domain around{.box = box, .wall = wall};
    around.wall->side = Side::both;
    constexpr size_t kMaxTries = 16; // rounds of `count` candidates; more if the wall is small in its box
    std::vector<Vec3d> found;
    for (size_t k = 0; k < kMaxTries && found.size() < count; ++k) {
        const Points seeds = scatterFrom(around, static_cast<int64_t>(k * count), count, kSeed, monitor);
        std::vector<std::optional<Vec3d>> onWall(count);
        parallelFor(
            count, 64,
            [&](size_t begin, size_t end) {
                for (size_t i = begin; i < end; ++i) onWall[i] = detail::ontoWall(wall, box, seeds.position(i));
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

} // namespace

std::vector<SplitFactor> compositionOf(Splitting splitting, size_t terms) {
    if (terms == 0) throw ValueError("a sum without terms cannot be split");
    std::vector<SplitFactor> factors;
    switch (splitting) {
        case Splitting::strang:
            appendStrang(1, terms, factors);
            return factors;
        case Splitting::yoshida: {
            const double outer = 1 / (2 - std::cbrt(2.0));
            for (const double part : {outer, 1 - 2 * outer, outer}) appendStrang(part, terms, factors);
            return factors;
        }
        case Splitting::none:
            break;
    }
    throw ValueError("this splitting is not a composition; choose strang or yoshida");
}

SumAtWall sumAtWall(const Flow& flow, size_t samples, const Monitor& monitor) {
    const Domain& domain = flow.domain();
    if (!domain.wall) return {};
    const std::vector<Vec3d> onWall = pointsOfWall(*domain.wall, domain.box, samples, monitor);
    const auto judge = [&](const Flow& part) {
        const double speed = rmsOf(part, monitor).speed, flux = greatestFlux(part, onWall);
        return AtWall{.speed = speed, .flux = speed > 0 ? flux / speed : 0};
    };
    SumAtWall sum{.whole = judge(flow), .terms = {}};
    for (const auto& potentials : flow.terms()) sum.terms.push_back(judge(Flow(potentials, domain)));
    return sum;
}

} // namespace curlew
