// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/AdvectParts.h"

#include "../flow/Samples.h"
#include "AdvectSteps.h"
#include "StepControl.h"
#include "curlew/field/Dimensions.h"

#include <fmt/format.h>
#include <tbb/parallel_sort.h>

#include <cstdint>
#include <limits>
#include <utility>

namespace curlew {

using namespace detail;

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

/// Returns the particles in the order of a Z-curve (Morton 1966) through the box. The particles of a batch are then
/// close together and look up the same parts of a level set.
std::vector<uint32_t> alongCurve(const Points& p, const Box& box) {
    constexpr int kBits = 10;
    const auto cell = [](double x, double lower, double size) {
        const double c = (x - lower) / size * (1 << kBits);
        return c > 0 ? static_cast<uint32_t>(std::min(c, (1 << kBits) - 1.0)) : 0u; // NaN, too
    };
    const Vec3d size = box.size();
    std::vector<std::pair<uint32_t, uint32_t>> codes(p.size());
    for (size_t k = 0; k < p.size(); ++k) {
        const std::array<uint32_t, 3> c{cell(p.x[k], box.lower[0], size[0]), cell(p.y[k], box.lower[1], size[1]),
                                        cell(p.z[k], box.lower[2], size[2])};
        uint32_t code = 0;
        for (int bit = kBits - 1; bit >= 0; --bit)
            for (const uint32_t axis : c) code = code << 1 | (axis >> bit & 1);
        codes[k] = {code, static_cast<uint32_t>(k)};
    }
    tbb::parallel_sort(codes.begin(), codes.end()); // no two are equal
    std::vector<uint32_t> order(codes.size());
    for (size_t k = 0; k < codes.size(); ++k) order[k] = codes[k].second;
    return order;
}

} // namespace

template <int N>
void detail::validate(const FlowN<N>& flow, const AdvectOptions& o) {
    if (o.steps < 0)
        throw ValueError(fmt::format("{} steps; give at least 1, or 0 to have the number chosen", o.steps));
    if (!std::isfinite(o.time)) throw ValueError("time must be finite");
    if (!(o.accuracy >= 0)) throw ValueError(fmt::format("accuracy {} must be positive", o.accuracy));
    const double rounding = std::numeric_limits<double>::epsilon() * length(flow.domain().box.size());
    if (o.accuracy > 0 && o.accuracy < rounding && std::isfinite(rounding)) // steps would become shorter without end
        throw ValueError(
            fmt::format("accuracy {:.3g} is below the rounding of positions in the flow's box; give at "
                        "least {:.3g}",
                        o.accuracy, rounding));
    if (o.adaptive() && !tableauOf(o.usedScheme()).embedded())
        throw ValueError(fmt::format("{} has no error estimate; choose rk23 or rk45 to use an accuracy, or give steps",
                                     kSchemeNames[static_cast<size_t>(o.usedScheme())]));
    if (!(o.maxStep >= 0)) throw ValueError(fmt::format("maxStep {} must be positive, or 0", o.maxStep));
    o.reprojection.validate(true); // a sum is split, or moved without reprojection
    splittingOf(flow, o);
}

template <int N>
AdvectOptions chosenSteps(const FlowN<N>& flow, const AdvectOptions& options) {
    validate(flow, options);
    AdvectOptions chosen = withAccuracy(options, flow.domain());
    if (splittingOf(flow, chosen) == Splitting::none) chosen = withScheme(chosen, flow.domain());
    chosen.scheme = chosen.usedScheme();
    return chosen;
}

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

std::vector<uint32_t> advectionOrder(const Flow& flow, const Points& particles) {
    const bool pays = flow.domain().wall && flow.domain().box.finite() && particles.size() <= UINT32_MAX;
    return pays ? alongCurve(particles, flow.domain().box) : std::vector<uint32_t>{};
}

#define CURLEW_INSTANTIATE(N)                                                  \
    template void detail::validate(const FlowN<N>&, const AdvectOptions&);     \
    template AdvectOptions chosenSteps(const FlowN<N>&, const AdvectOptions&); \
    template double firstStep(const FlowN<N>&, Scheme, double);
CURLEW_FOR_FLOW_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
