#pragma once

#include "curlew/field/Bound.h"
#include "curlew/math/Fade.h"

#include <algorithm>
#include <cmath>

namespace curlew::detail {

/// The alpha of Eq. 13, of the distance.
template <class T>
Univariate<T> alphaOf(const T& distance, double width) {
    const T rate = select(distance < T(0), T(-1), T(1)) / static_cast<T>(width);
    const Univariate<T> fade = quinticFade(distance * rate);
    return {fade.value, fade.first * rate, fade.second * rate * rate, fade.third * rate * rate * rate};
}

/// Eq. 13.
template <int N>
struct Bounded {
    static constexpr int kDimension = N;
    static constexpr bool kHasKernels = N == 3;
    ScalarFieldN<N> distance, noise;
    Side side;
    double width, steepness, middle, factor, shift;

    bool flows(double d) const { return d != 0 && (side == Side::both || (side == Side::inside) == (d < 0)); }

    template <int Order, class T>
    void evalBatch(const PointBatchN<N>& points, JetBatchN<NumberOf<T>, N, Order>& jets) const {
        if (const double sign = farSide(points); sign != 0 && flows(sign)) {
            noise.eval(points, jets);
            for (int i = 0; i < points.size; i += kLanes<T>)
                jets.set(i, target(T(static_cast<NumberOf<T>>(sign)), jets.template lanes<T>(i)));
            return;
        }
        distance.eval(points, jets);
        // The noise counts only where alpha > 0: beyond the wall, on the side of the flow.
        PointBatchN<N> layer;
        std::array<int, kBatch> lane;
        for (int i = 0; i < points.size; ++i) {
            if (!flows(static_cast<double>(jets.c[0][static_cast<size_t>(i)]))) continue;
            lane[static_cast<size_t>(layer.size)] = i;
            layer.push(points[i]);
        }
        if (layer.size == 0) {
            // Not every noise has third derivatives. Whether it has must not depend on the place.
            if constexpr (Order >= 3)
                if (points.size > 0) noise.template at<3>(points[0]);
            return;
        }
        JetBatchN<NumberOf<T>, N, Order> noises;
        noise.eval(layer, noises);
        if (layer.size == points.size) {
            for (int i = 0; i < points.size; i += kLanes<T>)
                jets.set(i, blend(jets.template lanes<T>(i), noises.template lanes<T>(i)));
        } else { // in the order of the layer, and back to their places
            JetBatchN<NumberOf<T>, N, Order> d;
            for (int k = 0; k < layer.size; ++k) d.set(k, jets[lane[static_cast<size_t>(k)]]);
            for (int k = 0; k < layer.size; k += kLanes<T>)
                d.set(k, blend(d.template lanes<T>(k), noises.template lanes<T>(k)));
            for (int k = 0; k < layer.size; ++k) jets.set(lane[static_cast<size_t>(k)], d[k]);
        }
    }

  private:
    /// The sign of the distance if all positions are surely beyond the layer that the wall shapes, else 0: one lookup
    /// for the whole batch, where it is compact.
    double farSide(const PointBatchN<N>& points) const {
        if (points.size < kBatch / 4) return 0;
        PointBatchN<N> centre;
        centre.size = 1;
        double squared = 0;
        for (size_t axis = 0; axis < N; ++axis) {
            const auto* x = points.c[axis].data();
            double lower = x[0], upper = x[0];
            for (int i = 1; i < points.size; ++i) {
                lower = std::min(lower, x[i]);
                upper = std::max(upper, x[i]);
            }
            centre.c[axis][0] = (lower + upper) / 2;
            squared += (upper - lower) * (upper - lower) / 4;
        }
        const double radius = steepness * std::sqrt(squared);
        if (!(radius < 2 * width)) return 0;
        JetBatchN<double, N, 0> d;
        distance.eval(centre, d);
        return std::abs(d.c[0][0]) > width + radius ? std::copysign(1.0, d.c[0][0]) : 0;
    }

    /// Where alpha is 1.
    template <class J, class T>
    J target(const T& sign, const J& n) const {
        return (n - J(static_cast<T>(middle))) * static_cast<T>(factor) + J(sign * static_cast<T>(shift));
    }

    template <class J>
    J blend(const J& d, const J& n) const {
        using T = std::remove_cvref_t<decltype(d.value)>;
        const Univariate<T> alpha = alphaOf(d.value, width);
        const J beyond = target(select(d.value < T(0), T(-1), T(1)), n);
        // The product rule brings in all three terms of the gradient.
        return select(alpha.value >= T(1), beyond, d + compose(d, alpha) * (beyond - d));
    }
};

/// The alpha of Eq. 13.
template <int N>
struct LayerFade {
    static constexpr int kDimension = N;
    ScalarFieldN<N> distance;
    double width;

    template <int Order, class T>
    void evalBatch(const PointBatchN<N>& points, JetBatchN<T, N, Order>& jets) const {
        distance.eval(points, jets);
        for (int i = 0; i < points.size; ++i) {
            const auto d = jets[i];
            jets.set(i, compose(d, alphaOf(d.value, width)));
        }
    }
    Range range() const { return {0, 1}; }
};

} // namespace curlew::detail
