#include "curlew/field/Bound.h"

#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Dimensions.h"
#include "curlew/math/Fade.h"

#include <fmt/format.h>

namespace curlew {

namespace {

template <int N>
struct Bounded {
    ScalarFieldN<N> distance, noise;
    Side side;
    double width, middle, factor, shift;

    bool flows(double d) const { return side == Side::both || (side == Side::inside) == (d < 0); }

    template <int Order, class T>
    void evalBatch(const PointBatchN<N>& points, JetBatchN<T, N, Order>& jets) const {
        distance.eval(points, jets);
        // The noise counts only where alpha > 0: beyond the wall, on the side of the flow.
        PointBatchN<N> layer;
        std::array<int, kBatch> lane;
        for (int i = 0; i < points.size; ++i) {
            const T d = jets.c[0][static_cast<size_t>(i)];
            if (d == T(0) || !flows(static_cast<double>(d))) continue;
            lane[static_cast<size_t>(layer.size)] = i;
            layer.push(points[i]);
        }
        if (layer.size == 0) {
            // Not every noise has third derivatives. Whether it has must not depend on the place.
            if constexpr (Order >= 3)
                if (points.size > 0) noise.template at<3>(points[0]);
            return;
        }
        JetBatchN<T, N, Order> noises;
        noise.eval(layer, noises);
        for (int k = 0; k < layer.size; ++k) {
            const int i = lane[static_cast<size_t>(k)];
            jets.set(i, blend(jets[i], noises[k]));
        }
    }

    template <class J>
    J blend(const J& d, const J& n) const {
        using T = decltype(d.value);
        const T sign = d.value < T(0) ? T(-1) : T(1), rate = sign / static_cast<T>(width);
        const auto fade = quinticFade(d.value * rate);
        const J target = (n - J(static_cast<T>(middle))) * static_cast<T>(factor) + J(sign * static_cast<T>(shift));
        if (fade.value >= T(1)) return target;
        const J alpha = compose(d, Univariate<T>{fade.value, fade.first * rate, fade.second * rate * rate,
                                                 fade.third * rate * rate * rate});
        return d + alpha * (target - d); // the product rule brings in all three terms of the gradient
    }
};

} // namespace

template <int N>
ScalarFieldN<N> bounded(const ScalarFieldN<N>& noise, const WallN<N>& wall, const BoundOptions& options) {
    if (!(wall.width > 0) || !std::isfinite(wall.width))
        throw ValueError(fmt::format("width {} must be positive and finite", wall.width));
    if (std::isnan(options.amplitude) || std::isinf(options.amplitude)) throw ValueError("amplitude must be finite");
    const Range range = noise.range();
    const double size = (range.upper - range.lower) / 2;
    const bool limited = std::isfinite(size) && size > 0;
    if (options.separate && !limited)
        throw ValueError(
            "separate=1 needs a noise whose range is known; use separate=0, or a noise instead of this field");
    const double amplitude = options.amplitude < 0 ? wall.width : options.amplitude;
    const double factor = amplitude > 0 && limited ? amplitude / size : 1;
    const double middle = limited ? (range.lower + range.upper) / 2 : 0;
    // Any shift above the noise's size separates; an eighth more keeps the values clear of zero.
    const double shift = options.separate ? 1.125 * factor * size : 0;
    return ScalarFieldN<N>(Bounded<N>{wall.sdf.distance, noise, wall.side, wall.width, middle, factor, shift});
}

template <int N>
ScalarFieldN<N> productBounded(const ScalarFieldN<N>& noise, const SdfN<N>& sdf, double range) {
    return noise * clipped(sdf.distance, range);
}

#define CURLEW_INSTANTIATE(N)                                                                       \
    template ScalarFieldN<N> bounded(const ScalarFieldN<N>&, const WallN<N>&, const BoundOptions&); \
    template ScalarFieldN<N> productBounded(const ScalarFieldN<N>&, const SdfN<N>&, double);
CURLEW_FOR_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
