// SPDX-License-Identifier: Apache-2.0
#include "FirstStep.h"

#include "../flow/Samples.h"
#include "StepControl.h"
#include "curlew/field/Dimensions.h"

#include <algorithm>
#include <limits>

namespace curlew::detail {

namespace {

/// Root mean squares over some samples of the domain.
struct Scales {
    double speed = 0;
    double rate = 0; ///< Norm of the velocity's Jacobian, 1/s.
};

template <int N>
Scales scalesOf(const FlowN<N>& flow) {
    constexpr size_t kEnough = 256, kPart = 4096, kMax = 1 << 17;
    double speeds = 0, rates = 0;
    size_t count = 0;
    for (size_t begin = 0; begin < kMax && count < kEnough; begin += kPart)
        visitSamples(flow.domain(), begin, begin + kPart, [&](const PointBatchN<N>& points) {
            for (int i = 0; i < points.size && count < kEnough; ++i, ++count) {
                const FlowSampleN<N> sample = flow.at(points[i]);
                speeds += dot(sample.velocity, sample.velocity);
                for (const Vec<double, N>& row : sample.derivative.rows) rates += dot(row, row);
            }
        });
    const double n = static_cast<double>(std::max<size_t>(count, 1));
    return {std::sqrt(speeds / n), std::sqrt(rates / n)};
}

} // namespace

template <int N>
double firstStep(const FlowN<N>& flow, Scheme scheme, double accuracy) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    if (!flow.domain().box.finite()) return kInfinity;
    const auto [speed, rate] = scalesOf(flow);
    if (!(rate > 0) || !(speed > 0) || !std::isfinite(rate)) return kInfinity;
    // The error of a step, relative to the length over which the velocity changes, is about (rate · step)^order / 100.
    const double radians = std::pow(100 * accuracy * rate / speed, 1.0 / tableauOf(scheme).errorOrder);
    // Round to a power of 2^(1/8), because rounding errors of these functions differ between processors.
    return powerOfTwo(static_cast<int>(std::lround(8 * std::log2(std::min(radians, 1.0) / rate))));
}

#define CURLEW_INSTANTIATE(N) template double firstStep(const FlowN<N>&, Scheme, double);
CURLEW_FOR_FLOW_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew::detail
