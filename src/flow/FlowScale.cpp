// SPDX-License-Identifier: Apache-2.0
#include "curlew/flow/FlowScale.h"

#include "Samples.h"
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/Dimensions.h"

#include <cmath>
#include <numbers>

namespace curlew {

namespace {

constexpr size_t kScaleSamples = 1 << 13, kScaleGrain = 1 << 9;

struct ScaleSums {
    double count = 0, squares = 0, gradients = 0;
    Vec3d velocity{};
    ScaleSums& operator+=(const ScaleSums& o) {
        count += o.count, squares += o.squares, gradients += o.gradients;
        velocity += o.velocity;
        return *this;
    }
};

void add(ScaleSums& sums, const FlowSample& sample) {
    double gradient = 0;
    for (int axis = 0; axis < 3; ++axis) gradient += dot(sample.derivative[axis], sample.derivative[axis]);
    sums += {.count = 1,
             .squares = dot(sample.velocity, sample.velocity),
             .gradients = gradient,
             .velocity = sample.velocity};
}

} // namespace

template <int N>
double movingSpeedOf(const FlowN<N>& flow, const Monitor& monitor) {
    const double speed = rmsOf(flow, monitor).speed;
    if (!(speed > 0) || !std::isfinite(speed))
        throw ValueError(
            flow.terms().empty()
                ? "the flow does not move: its velocity is zero everywhere in the box"
                : "the flow does not move: the gradients of f and g are parallel everywhere; use two different fields "
                  "(seeds)");
    return speed;
}

double wavelengthOf(const Flow& flow, const Monitor& monitor) {
    if (!flow.domain().box.finite()) return 0;
    const ScaleSums sums = parallelSum(
        kScaleSamples, kScaleGrain,
        [&](size_t begin, size_t end) {
            ScaleSums mine;
            visitSamples(flow.domain(), begin, end, [&](const PointBatch& points) {
                for (int i = 0; i < points.size; ++i) add(mine, flow.at(points[i]));
            });
            return mine;
        },
        monitor);
    if (!(sums.count > 0) || !(sums.gradients > 0)) return 0;
    const Vec3d mean = sums.velocity * (1 / sums.count);
    const double variance = std::max(0.0, sums.squares / sums.count - dot(mean, mean));
    // Summed over components, a plane wave's mean square gradient is k² times its variance, k = 2π / wavelength.
    return 2 * std::numbers::pi * std::sqrt(variance / (sums.gradients / sums.count));
}

#define CURLEW_INSTANTIATE(N) template double movingSpeedOf(const FlowN<N>&, const Monitor&);
CURLEW_FOR_FLOW_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
