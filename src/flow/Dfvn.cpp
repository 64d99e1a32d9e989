#include "curlew/flow/Dfvn.h"

#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/base/Random.h"
#include "curlew/field/Algebra.h"

#include <fmt/format.h>

namespace curlew {

FlowSample Dfvn::at(const Vec3d& position) const {
    const auto f = mF.at<2>(position), g = mG.at<2>(position);
    FlowSample sample{.velocity = cross(f.gradient, g.gradient), .f = f.value, .g = g.value, .derivative = {}};
    for (int j = 0; j < 3; ++j) {
        const Vec3d fj{{f.hessian(0, j), f.hessian(1, j), f.hessian(2, j)}};
        const Vec3d gj{{g.hessian(0, j), g.hessian(1, j), g.hessian(2, j)}};
        const Vec3d column = cross(fj, g.gradient) + cross(f.gradient, gj);
        for (size_t i = 0; i < 3; ++i) sample.derivative.rows[i][j] = column[static_cast<int>(i)];
    }
    return sample;
}

namespace {

constexpr uint64_t kSampleSeed = 0x6375726c6577; // any fixed number will do
constexpr size_t kCandidates = size_t{1} << 17, kMostCandidates = size_t{1} << 24, kEnoughSamples = 4096;
constexpr size_t kGrain = 4096;

struct Sums {
    double count = 0, speed = 0, f = 0, g = 0;
    Sums& operator+=(const Sums& o) {
        count += o.count;
        speed += o.speed;
        f += o.f;
        g += o.g;
        return *this;
    }
};

Sums sumOver(const Dfvn& flow, size_t begin, size_t end) {
    const Box& box = flow.domain().box;
    const Vec3d size = box.size();
    Sums sums;
    PointBatch candidates, points;
    const auto flush = [&] {
        JetBatch<double, 1> f, g;
        VecBatch<double> c;
        flow.eval(points, f, g, c);
        for (int i = 0; i < points.size; ++i) {
            const double fi = f[i].value, gi = g[i].value;
            sums += {1, dot(c[i], c[i]), fi * fi, gi * gi};
        }
        points.size = 0;
    };
    const auto sift = [&] {
        std::array<bool, kBatch> allowed;
        std::array<double, kBatch> distance;
        classify(flow.domain(), candidates, allowed, distance);
        for (int i = 0; i < candidates.size; ++i) {
            if (!allowed[static_cast<size_t>(i)]) continue;
            points.push(candidates[i]);
            if (points.full()) flush();
        }
        candidates.size = 0;
    };
    for (size_t k = begin; k < end; ++k) {
        Vec3d p;
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = box.lower[axis] + size[axis] * randomUniform(kSampleSeed, k, static_cast<uint64_t>(axis));
        candidates.push(p);
        if (candidates.full()) sift();
    }
    sift();
    flush();
    return sums;
}

} // namespace

FlowMagnitudes magnitudesOf(const Dfvn& flow, const Monitor& monitor) {
    if (!flow.domain().box.finite()) throw ValueError("the domain of the flow is infinite; give it a box");
    Sums total;
    // A thin domain takes more tries.
    for (size_t begin = 0, end = kCandidates; begin < kMostCandidates && total.count < kEnoughSamples;
         begin = end, end *= 8) {
        std::vector<Sums> chunks((end - begin + kGrain - 1) / kGrain);
        parallelFor(
            end - begin, kGrain,
            [&](size_t from, size_t to) { chunks[from / kGrain] = sumOver(flow, begin + from, begin + to); }, monitor);
        for (const Sums& chunk : chunks) total += chunk;
    }
    if (total.count == 0)
        throw ValueError("the domain of the flow is empty: no point of its box lies on the flow's side of the wall");
    return {std::sqrt(total.speed / total.count), std::sqrt(total.f / total.count), std::sqrt(total.g / total.count)};
}

Dfvn withSpeed(const Dfvn& flow, double speed, const Monitor& monitor) {
    const double now = magnitudesOf(flow, monitor).speed;
    if (!(now > 0) || !std::isfinite(now))
        throw ValueError(
            "the flow does not move: the gradients of f and g are parallel everywhere; use two different fields "
            "(seeds)");
    constexpr double kMostSpeed = 1e15; // beyond, velocities in float overflow where the flow is fastest
    if (!(speed > 0) || !(speed <= kMostSpeed))
        throw ValueError(fmt::format("speed {} must be positive and at most {}", speed, kMostSpeed));
    return speed == now ? flow : Dfvn((speed / now) * flow.f(), flow.g(), flow.domain());
}

} // namespace curlew
