// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "AlgebraModels.h"
#include "curlew/field/Bound.h"
#include "curlew/math/Fade.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>

namespace curlew::detail {

/// The blend of a layer at the depth s >= 0, in widths. alpha rises from 0 to 1. Its slope is 3/2 over the middle third
/// and follows a cubic smoothstep over each outer third, so alpha is C². A quintic fade is steeper in the middle, which
/// would make the flow faster there. `levelled` is the integral of 1 - alpha.
template <class T>
struct LayerBlend {
    Univariate<T> alpha;
    T levelled;

    explicit LayerBlend(T depth) {
        constexpr double kRamp = 1.0 / 3, kSlope = 1 / (1 - kRamp);
        const T s = min(T(1), depth), m = min(s, T(1) - s), t = min(T(1), m * T(1 / kRamp));
        const T beyond = mulAdd(T(-kRamp), t, m), t2 = t * t; // part of m beyond the ramp
        const T half = T(kSlope) * (T(kRamp) * (t2 * t * mulAdd(T(-0.5), t, T(1))) + beyond);
        const T area = T(kSlope) * (T(kRamp * kRamp) * (t2 * t2 * mulAdd(T(-0.1), t, T(0.25))) + T(0.5) * beyond * m);
        const auto rising = s < T(0.5);
        const T bend = T(6 * kSlope / kRamp) * t * (T(1) - t);
        alpha = {select(rising, half, T(1) - half), T(kSlope) * t2 * mulAdd(T(-2), t, T(3)),
                 select(rising, bend, -bend),
                 select((t > T(0)) & (t < T(1)), T(6 * kSlope / (kRamp * kRamp)) * mulAdd(T(-2), t, T(1)), T(0))};
        levelled = select(rising, s, T(0.5)) - area;
    }
};

template <int Order>
struct BlendKernel;

/// Eq. 13 with a distance that levels off.
template <int N>
struct Bounded {
    static constexpr int kDimension = N;
    static constexpr bool kHasKernels = N == 3;
    ScalarFieldN<N> distance, noise;
    Side side;
    double width, lipschitz, middle, factor, shift;

    double wavelength() const { return noise.wavelength(); }

    template <class Number>
    bool flows(Number d) const {
        return side == Side::both ? d != 0 : side == Side::inside ? d < 0 : d > 0;
    }

    template <int Order, class T>
    void evalBatch(const PointBatchN<N>& points, JetBatchN<NumberOf<T>, N, Order>& jets) const {
        if (const double sign = farSide(points); sign != 0 && flows(sign)) {
            noise.eval(points, jets);
            for (int i = 0; i < points.size; i += kLanes<T>)
                jets.set(i, target(T(static_cast<NumberOf<T>>(sign)), jets.template lanes<T>(i)));
            return;
        }
        distance.eval(points, jets);
        blendNoise<Order, T>(points, jets);
    }

    template <int Order, class T>
    OnLattice<T, Order> onLattice(const PointLattice& lattice) const requires(N == 3) {
        OnLattice<T, Order> distances;
        if (const double sign = farSide(lattice); sign != 0 && flows(sign)) // any distance beyond the layer will do
            distances = [far = static_cast<T>(sign * 2 * width)](const LatticeBatch&, JetBatch<T, Order>& jets) {
                jets = {};
                jets.c[0].fill(far);
            };
        else
            distances = distance.template onLattice<T, Order>(lattice);
        return [this, distances = std::move(distances)](const LatticeBatch& batch, JetBatch<T, Order>& jets) {
            distances(batch, jets);
            runKernel<BlendKernel<Order>, T>(*this, batch.points(), jets);
        };
    }

    /// Replaces the distances at the points by the field's values.
    template <int Order, class T>
    void blendNoise(const PointBatchN<N>& points, JetBatchN<NumberOf<T>, N, Order>& jets) const {
        // The noise contributes only where alpha > 0: on the flow's side of the wall.
        const auto [flowing, beyond] = counts(jets.c[0], points.size);
        if (flowing == 0) {
            // Not every noise has third derivatives. Whether this throws must not depend on the position.
            if constexpr (Order >= 3)
                if (points.size > 0) noise.template at<3>(points[0]);
            return;
        }
        if (flowing == points.size) return blendAll<Order, T>(points, beyond == flowing, jets);
        PointBatchN<N> layer;
        std::array<int, kBatch> lane;
        for (int i = 0; i < points.size; ++i) {
            if (!flows(jets.c[0][static_cast<size_t>(i)])) continue;
            lane[static_cast<size_t>(layer.size)] = i;
            layer.push(points[i]);
        }
        JetBatchN<NumberOf<T>, N, Order> inLayer;
        for (int k = 0; k < layer.size; ++k) inLayer.set(k, jets[lane[static_cast<size_t>(k)]]);
        blendAll<Order, T>(layer, false, inLayer);
        for (int k = 0; k < layer.size; ++k) jets.set(lane[static_cast<size_t>(k)], inLayer[k]);
    }

    /// The noise counts only where alpha > 0, so its symbols need no branch.
    template <int Order>
    Jet<Symbol<float>, N, Order> symbols(SymbolModule& module, const Vec<Symbol<double>, N>& p) const {
        using S = Symbol<float>;
        const auto d = distance.template symbols<Order>(module, p);
        const Symbol<bool> flowing = side == Side::both     ? !(d.value == S(0))
                                     : side == Side::inside ? d.value < S(0)
                                                            : d.value > S(0);
        return select(flowing, blend(d, noise.template symbols<Order>(module, p)), d);
    }

  private:
    /// Returns the sign of the distance if all positions are certainly beyond the layer, else 0. If the batch is
    /// compact, one lookup serves all of it. Not inline: kernels for other instruction sets share it.
    double farSide(const PointBatchN<N>& points) const;
    double farSide(const PointLattice& lattice) const requires(N == 3);
    double farSide(const BoxN<N>& box) const;

    /// Of positions: how many are on the flow's side of the wall, and how many beyond the layer on either side.
    struct Counts {
        int flowing, beyond;
    };
    template <class Number>
    Counts counts(const std::array<Number, kBatch>& distances, int size) const {
        using Count = std::conditional_t<sizeof(Number) == sizeof(int64_t), int64_t, int32_t>; // as wide, for SIMD
        Count flowing = 0, beyond = 0;
        for (size_t i = 0; i < static_cast<size_t>(size); ++i) {
            flowing += static_cast<Count>(flows(distances[i]));
            beyond += static_cast<Count>(std::abs(distances[i]) >= static_cast<Number>(width));
        }
        return {static_cast<int>(flowing), static_cast<int>(beyond)};
    }

    /// The same as blendNoise() where all points are on the flow's side of the wall; `beyond`: and beyond the layer.
    template <int Order, class T>
    void blendAll(const PointBatchN<N>& points, bool beyond, JetBatchN<NumberOf<T>, N, Order>& jets) const {
        JetBatchN<NumberOf<T>, N, Order> noises;
        noise.eval(points, noises);
        for (int i = 0; i < points.size; i += kLanes<T>) {
            const auto d = jets.template lanes<T>(i), n = noises.template lanes<T>(i);
            jets.set(i, beyond ? target(signOf(d.value), n) : blend(d, n));
        }
    }

    template <class T>
    static T signOf(const T& d) {
        return select(d < T(0), T(-1), T(1));
    }

    /// The noise as it is blended: centred, scaled and shifted by sign · by, where `sign` is that of the distance.
    template <class J, class T>
    J shifted(const J& n, const T& sign, double by) const {
        return (n - J(static_cast<T>(middle))) * static_cast<T>(factor) + J(sign * static_cast<T>(by));
    }

    /// The result where alpha is 1; there the levelled distance is half of the width.
    template <class J, class T>
    J target(const T& sign, const J& n) const {
        return shifted(n, sign, shift + width / 2);
    }

    template <class J>
    J blend(const J& d, const J& n) const {
        using T = std::remove_cvref_t<decltype(d.value)>;
        const T sign = signOf(d.value), w(static_cast<NumberOf<T>>(width)), rate = sign / w;
        const LayerBlend<T> at(abs(d.value) / w);
        const Univariate<T> alpha{at.alpha.value, at.alpha.first * rate, at.alpha.second * rate * rate,
                                  at.alpha.third * rate * rate * rate};
        const Univariate<T> levelled{sign * at.levelled * w, T(1) - alpha.value, -alpha.first, -alpha.second};
        // The product rule yields all terms of the gradient.
        return select(alpha.value >= T(1), target(sign, n),
                      compose(d, levelled) + compose(d, alpha) * shifted(n, sign, shift));
    }
};

/// Computes a bounded field from distances.
template <int Order>
struct BlendKernel {
    template <class T>
    static void run(const Bounded<3>& field, const PointBatch& points, JetBatch<NumberOf<T>, Order>& jets) {
        field.blendNoise<Order, T>(points, jets);
    }
};

/// The quintic fade of the depth as a function of the distance.
struct LayerFade {
    double width;

    template <class J>
    J operator()(const J& d) const {
        using T = ValueOf<J>;
        const T rate = select(d.value < T(0), T(-1), T(1)) / T(static_cast<NumberOf<T>>(width));
        const Univariate<T> fade = quinticFade(d.value * rate);
        return compose(d, Univariate<T>{fade.value, fade.first * rate, fade.second * rate * rate,
                                        fade.third * rate * rate * rate});
    }
};

/// Bridson's ramp: 15/8 r - 10/8 r³ + 3/8 r⁵ for |r| <= 1, constant beyond.
struct LayerRamp {
    double width; ///< Negative: the ramp rises towards the inside.

    template <class J>
    J operator()(const J& d) const {
        using T = ValueOf<J>;
        const T rate(static_cast<NumberOf<T>>(1 / width));
        const T r = min(T(1), max(T(-1), d.value * rate)), s = r * r, left = T(1) - s;
        const T third = select(left > T(0), mulAdd(s, T(22.5), T(-7.5)), T(0));
        return compose(
            d, Univariate<T>{r * mulAdd(s, mulAdd(s, T(0.375), T(-1.25)), T(1.875)), T(1.875) * left * left * rate,
                             T(-7.5) * r * left * rate * rate, third * rate * rate * rate});
    }
};

} // namespace curlew::detail
