// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/Bound.h"

#include "BoundModel.h"
#include "curlew/base/Error.h"
#include "curlew/base/Require.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Dimensions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace curlew {

namespace detail {

template <int N>
double Bounded<N>::farSide(const BoxN<N>& box) const {
    const double radius = lipschitz * length(box.size()) / 2;
    if (!(radius < 2 * width)) return 0;
    const double d = distance.template at<0>(box.center()).value;
    return std::abs(d) > width + radius ? std::copysign(1.0, d) : 0;
}

template <int N>
double Bounded<N>::farSide(const PointBatchN<N>& points) const {
    if (points.size < kBatch / 4) return 0;
    BoxN<N> box;
    for (int axis = 0; axis < N; ++axis) {
        const auto* x = points.c[static_cast<size_t>(axis)].data();
        double lower = x[0], upper = x[0];
        for (int i = 1; i < points.size; ++i) {
            lower = std::min(lower, x[i]);
            upper = std::max(upper, x[i]);
        }
        box.lower[axis] = lower;
        box.upper[axis] = upper;
    }
    return farSide(box);
}

template <int N>
double Bounded<N>::farSide(const PointLattice& lattice) const requires(N == 3) {
    if (lattice.size() < kBatch / 4) return 0;
    BoxN<N> box;
    for (int axis = 0; axis < N; ++axis) {
        const auto x = lattice.coordinates[static_cast<size_t>(axis)];
        const auto [lower, upper] = std::minmax_element(x.begin(), x.end());
        box.lower[axis] = *lower;
        box.upper[axis] = *upper;
    }
    return farSide(box);
}

} // namespace detail

using namespace detail;

namespace {

constexpr double kMaxOfObject = 0.25; ///< Of an edge of the object's box: the limit of a default width.

/// The known range of a noise's values.
struct Values {
    double middle = 0, size = 0; ///< Centre and half-length of the range.
    bool limited = false;

    explicit Values(const Interval& range) : size((range.upper - range.lower) / 2) {
        limited = std::isfinite(size) && size > 0;
        if (limited) middle = (range.lower + range.upper) / 2;
    }
    void require(const char* option) const {
        if (!limited)
            throw ValueError(fmt::format(
                "{} needs a noise whose range is known; leave it out, or use a noise instead of this field", option));
    }
};

template <int N>
double factorFor(const ScalarFieldN<N>& noise, const Values& values, const BoxN<N>& where,
                 const BoundOptions& options) {
    if (options.amplitude == 0) return 1;
    if (options.amplitude < 0) return 1 / (options.slope > 0 ? options.slope : noiseScaleOf(noise, where).slope);
    values.require("amplitude=");
    return options.amplitude / values.size;
}

/// Returns the term that modulates the slope at the wall by 1 ± variation. It vanishes beyond the layer.
template <int N>
ScalarFieldN<N> modulation(const ScalarFieldN<N>& noise, const WallN<N>& wall, const Values& values, double variation) {
    const auto relative = (variation / values.size) * (noise - constantField<N>(values.middle));
    return relative * (constantField<N>(1) - layerFade(wall)) * clipped(wall.sdf.distance, wall.width);
}

} // namespace

template <int N>
LayerWidth layerWidth(const ScalarFieldN<N>& noise, const BoxN<N>& bounds, Side side) {
    LayerWidth layer{.noise = noiseScaleOf(noise, bounds)};
    layer.width = kLayerInWavelengths * layer.noise.wavelength;
    if (!bounds.finite()) return layer;
    const Vec<double, N> size = bounds.size();
    double shortest = size[0], longest = size[0];
    for (const double edge : size.c) {
        shortest = std::min(shortest, edge);
        longest = std::max(longest, edge);
    }
    const double most = kMaxOfObject * (side == Side::outside ? longest : shortest);
    layer.limited = layer.width > most && most > 0;
    if (layer.limited) layer.width = most;
    return layer;
}

template <int N>
ScalarFieldN<N> bounded(const ScalarFieldN<N>& noise, const WallN<N>& wall, const BoundOptions& options) {
    if (!(wall.width > 0) || !std::isfinite(wall.width))
        throw ValueError(fmt::format("width {} must be positive and finite", wall.width));
    if (!std::isfinite(options.amplitude)) throw ValueError("amplitude must be finite");
    if (!(options.variation >= 0 && options.variation < 1))
        throw ValueError(fmt::format("variation {} must be at least 0 and below 1", options.variation));
    const Values values(noise.range());
    if (options.separate) values.require("separate=1");
    const double factor = factorFor(noise, values, wall.sdf.bounds, options);
    // A shift separates if it exceeds the noise minus the levelled distance. An eighth of the noise's size more keeps
    // the values clear of zero.
    const double shift = options.separate ? std::max(0.0, 1.125 * factor * values.size - wall.width / 2) : 0;
    ScalarFieldN<N> g(
        Bounded<N>{wall.sdf.distance, noise, wall.side, wall.width, wall.sdf.lipschitz, values.middle, factor, shift});
    if (options.variation == 0) return g;
    values.require("variation=");
    return g + modulation(noise, wall, values, options.variation);
}

template <int N>
ScalarFieldN<N> layerFade(const WallN<N>& wall) {
    requirePositive(wall.width, "width");
    return ScalarFieldN<N>(Unary<N, LayerFade>{wall.sdf.distance, {wall.width}, {0, 1}});
}

template <int N>
ScalarFieldN<N> layerRamp(const WallN<N>& wall) {
    requirePositive(wall.width, "width");
    const LayerRamp ramp{wall.side == Side::outside ? wall.width : -wall.width};
    return ScalarFieldN<N>(Unary<N, LayerRamp>{wall.sdf.distance, ramp, {-1, 1}});
}

template <int N>
ScalarFieldN<N> productBounded(const ScalarFieldN<N>& noise, const SdfN<N>& sdf, double range) {
    return noise * clipped(sdf.distance, range);
}

#define CURLEW_INSTANTIATE(N)                                                                       \
    template double detail::Bounded<N>::farSide(const PointBatchN<N>&) const;                       \
    template double detail::Bounded<N>::farSide(const BoxN<N>&) const;                              \
    template LayerWidth layerWidth(const ScalarFieldN<N>&, const BoxN<N>&, Side);                   \
    template ScalarFieldN<N> bounded(const ScalarFieldN<N>&, const WallN<N>&, const BoundOptions&); \
    template ScalarFieldN<N> layerFade(const WallN<N>&);                                            \
    template ScalarFieldN<N> layerRamp(const WallN<N>&);                                            \
    template ScalarFieldN<N> productBounded(const ScalarFieldN<N>&, const SdfN<N>&, double);
CURLEW_FOR_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE
template double detail::Bounded<3>::farSide(const PointLattice&) const;

} // namespace curlew
