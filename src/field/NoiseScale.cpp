// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/NoiseScale.h"

#include "curlew/base/Error.h"
#include "curlew/base/Random.h"
#include "curlew/field/Dimensions.h"
#include "curlew/field/ForEachBatch.h"

#include <algorithm>
#include <cmath>

namespace curlew {

namespace {

constexpr size_t kSamples = 8192;
constexpr uint64_t kSlopeSeed = 0x736c6f7065; // an arbitrary constant
constexpr double kWavelengths = 8;            ///< Minimum size of the sampled box along each axis.
constexpr double kDeviationsPerWavelength = 7;

struct Sums {
    double value = 0, square = 0, slope = 0;
    Sums& operator+=(const Sums& o) {
        value += o.value, square += o.square, slope += o.slope;
        return *this;
    }
};

template <int N>
BoxN<N> sampledBox(const BoxN<N>& wanted, double wavelength) {
    BoxN<N> box = wanted.finite() ? wanted : BoxN<N>{}.padded(1);
    for (int axis = 0; axis < N; ++axis) {
        const double centre = (box.lower[axis] + box.upper[axis]) / 2;
        const double half = std::max(box.upper[axis] - centre, kWavelengths / 2 * wavelength);
        box.lower[axis] = centre - half;
        box.upper[axis] = centre + half;
    }
    return box;
}

} // namespace

template <int N>
NoiseScale noiseScaleOf(const ScalarFieldN<N>& noise, const BoxN<N>& box) {
    const double wavelength = noise.wavelength();
    const BoxN<N> sampled = sampledBox(box, wavelength);
    const auto size = sampled.size();
    const PointsBy positions{kSamples, [&](size_t k) {
                                 Vec<double, N> p;
                                 for (int axis = 0; axis < N; ++axis)
                                     p[axis] = sampled.lower[axis] +
                                               size[axis] * randomUniform(kSlopeSeed, k, static_cast<uint64_t>(axis));
                                 return p;
                             }};
    const Sums sums = sumOverBatches(positions, [&](const PointBatchN<N>& points, size_t) {
        JetBatchN<double, N, 1> jets;
        noise.eval(points, jets);
        Sums sum;
        for (int i = 0; i < points.size; ++i) {
            const auto jet = jets[i];
            sum += {jet.value, jet.value * jet.value, dot(jet.gradient, jet.gradient)};
        }
        return sum;
    });
    const double mean = sums.value / kSamples, slope = std::sqrt(sums.slope / kSamples);
    const double deviation = std::sqrt(std::max(0.0, sums.square / kSamples - mean * mean));
    if (!(slope > 0) || !std::isfinite(slope))
        throw ValueError("the noise is constant (or not finite), so it has no slope to scale; give another field");
    if (wavelength > 0) return {.wavelength = wavelength, .slope = slope};
    return {.wavelength = kDeviationsPerWavelength * deviation / slope, .measured = true, .slope = slope};
}

#define CURLEW_INSTANTIATE(N) template NoiseScale noiseScaleOf(const ScalarFieldN<N>&, const BoxN<N>&);
CURLEW_FOR_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
