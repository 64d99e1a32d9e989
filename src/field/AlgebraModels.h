// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/ScalarField.h"
#include "curlew/math/Fade.h"

#include <algorithm>

namespace curlew::detail {

template <int N>
struct Constant {
    static constexpr int kDimension = N;
    static constexpr bool kHasKernels = N == 3;
    double value;
    template <int Order, class T>
    Jet<T, N, Order> at(const Vec<Rebind<T, double>, N>&) const {
        return static_cast<T>(value);
    }
    Interval range() const { return {value, value}; }
    bool homogeneous() const { return true; }
};

template <int N>
struct Ramp {
    static constexpr int kDimension = N;
    static constexpr bool kHasKernels = N == 3;
    Vec<double, N> direction;
    double offset;
    template <int Order, class T>
    Jet<T, N, Order> at(const Vec<Rebind<T, double>, N>& p) const {
        using Position = Rebind<T, double>;
        Position height(offset);
        for (int i = 0; i < N; ++i) height = mulAdd(Position(direction[i]), p[i], height);
        Jet<T, N, Order> jet(convertTo<T>(height));
        if constexpr (Order >= 1)
            for (int i = 0; i < N; ++i) jet.gradient[i] = static_cast<T>(direction[i]);
        return jet;
    }
    bool homogeneous() const { return true; }
};

/// Whether a function is linear in its jets.
template <class Function>
constexpr bool kIsLinear = requires {
    Function::kLinear;
};

/// Applies a model's function to the jets of the fields that it is made of.
template <int Order>
struct ApplyKernel {
    template <class T, class Model>
    static void run(const Model& model, const int& size, JetBatch<NumberOf<T>, Order>& jets) {
        model.template apply<Order, T>(size, jets);
    }
    template <class T, class Model>
    static void run(const Model& model, const int& size, JetBatch<NumberOf<T>, Order>& jets,
                    const JetBatch<NumberOf<T>, Order>& other) {
        model.template apply<Order, T>(size, jets, other);
    }
};

/// Applies `combine` to the jets of two fields at the same position.
template <int N, class Combine>
struct Binary {
    static constexpr int kDimension = N;
    static constexpr bool kHasKernels = N == 3;
    ScalarFieldN<N> a, b;
    Combine combine;
    Interval interval;

    template <int Order, class T>
    void evalBatch(const PointBatchN<N>& points, JetBatchN<NumberOf<T>, N, Order>& jets) const {
        JetBatchN<NumberOf<T>, N, Order> other;
        a.eval(points, jets);
        b.eval(points, other);
        apply<Order, T>(points.size, jets, other);
    }
    template <int Order, class T>
    OnLattice<T, Order> onLattice(const PointLattice& lattice) const requires(N == 3) {
        return [this, onA = a.template onLattice<T, Order>(lattice), onB = b.template onLattice<T, Order>(lattice)](
                   const LatticeBatch& batch, JetBatch<T, Order>& jets) {
            JetBatch<T, Order> other;
            onA(batch, jets);
            onB(batch, other);
            const int count = batch.size();
            runKernel<ApplyKernel<Order>, T>(*this, count, jets, std::as_const(other));
        };
    }
    template <int Order, class T>
    void apply(int size, JetBatchN<NumberOf<T>, N, Order>& jets, const JetBatchN<NumberOf<T>, N, Order>& other) const {
        for (int i = 0; i < size; i += kLanes<T>)
            jets.set(i, combine(jets.template lanes<T>(i), other.template lanes<T>(i)));
    }
    template <int Order>
    Jet<Symbol<float>, N, Order> symbols(SymbolModule& module, const Vec<Symbol<double>, N>& p) const {
        return combine(a.template symbols<Order>(module, p), b.template symbols<Order>(module, p));
    }
    Interval range() const { return interval; }
    double wavelength() const { return std::max(a.wavelength(), b.wavelength()); }
    bool homogeneous() const { return kIsLinear<Combine> && a.homogeneous() && b.homogeneous(); }
};

/// Applies `map` to the jet of a field.
template <int N, class Map>
struct Unary {
    static constexpr int kDimension = N;
    static constexpr bool kHasKernels = N == 3;
    ScalarFieldN<N> a;
    Map map;
    Interval interval;

    template <int Order, class T>
    void evalBatch(const PointBatchN<N>& points, JetBatchN<NumberOf<T>, N, Order>& jets) const {
        a.eval(points, jets);
        apply<Order, T>(points.size, jets);
    }
    template <int Order, class T>
    OnLattice<T, Order> onLattice(const PointLattice& lattice) const requires(N == 3) {
        return
            [this, on = a.template onLattice<T, Order>(lattice)](const LatticeBatch& batch, JetBatch<T, Order>& jets) {
                on(batch, jets);
                const int count = batch.size();
                runKernel<ApplyKernel<Order>, T>(*this, count, jets);
            };
    }
    template <int Order, class T>
    void apply(int size, JetBatchN<NumberOf<T>, N, Order>& jets) const {
        for (int i = 0; i < size; i += kLanes<T>) jets.set(i, map(jets.template lanes<T>(i)));
    }
    template <int Order>
    Jet<Symbol<float>, N, Order> symbols(SymbolModule& module, const Vec<Symbol<double>, N>& p) const {
        return map(a.template symbols<Order>(module, p));
    }
    Interval range() const { return interval; }
    double wavelength() const { return a.wavelength(); }
    bool homogeneous() const { return kIsLinear<Map> && a.homogeneous(); }
};

template <class J>
using ValueOf = std::remove_cvref_t<decltype(J::value)>;

struct Sum {
    static constexpr bool kLinear = true;
    template <class J>
    J operator()(const J& p, const J& q) const {
        return p + q;
    }
};

struct Difference {
    static constexpr bool kLinear = true;
    template <class J>
    J operator()(const J& p, const J& q) const {
        return p - q;
    }
};

struct Product {
    template <class J>
    J operator()(const J& p, const J& q) const {
        return p * q;
    }
};

struct Quotient {
    template <class J>
    J operator()(const J& p, const J& q) const {
        return p * reciprocal(q);
    }
};

struct Scaled {
    static constexpr bool kLinear = true;
    double factor;
    template <class J>
    J operator()(const J& p) const {
        return p * static_cast<ValueOf<J>>(factor);
    }
};

/// The minimum of two jets, C²: where they differ by less than `smoothing`, a cubic replaces the kink.
struct SmoothMin {
    double smoothing;
    template <class J>
    J operator()(const J& p, const J& q) const {
        using T = ValueOf<J>;
        const auto k = static_cast<T>(smoothing);
        const J gap = p - q;
        const Univariate<T> m = negativePart(gap.value / k);
        const J blend = q + compose(gap, Univariate<T>{k * m.value, m.first, m.second / k, m.third / (k * k)});
        return select(abs(gap.value) < k, blend, select(gap.value < T(0), p, q));
    }

  private:
    /// min(t, 0) with the kink between -1 and 1 replaced.
    template <class T>
    static Univariate<T> negativePart(T t) {
        const T s = max(T(0), T(1) - abs(t)), sign = select(t < T(0), T(-1), T(1)), half = s * s * T(0.5);
        const T step = select(t < T(0), T(1), T(0));
        return {min(t, T(0)) - s * half * T(1.0 / 3), mulAdd(sign, half, step), -s, select(abs(t) < T(1), sign, T(0))};
    }
};

/// The range times the odd function of t = value / range with the slope 1 - quinticFade(|t|). It reaches half the
/// range.
struct Clip {
    double range;
    template <class J>
    J operator()(const J& p) const {
        using T = ValueOf<J>;
        const auto k = static_cast<T>(range);
        const Univariate<T> c = clip(p.value / k);
        return compose(p, Univariate<T>{k * c.value, c.first, c.second / k, c.third / (k * k)});
    }

  private:
    template <class T>
    static Univariate<T> clip(T t) {
        const T size = min(T(1), abs(t)), sign = select(t < T(0), T(-1), T(1));
        const Univariate<T> fade = quinticFade(size);
        const T s2 = size * size, s4 = s2 * s2;
        // Rounding must not exceed the range.
        const T value = min(T(0.5), negMulAdd(s4, mulAdd(T(-3), size, s2) + T(2.5), size));
        return {sign * value, T(1) - fade.value, -sign * fade.first, -fade.second};
    }
};

} // namespace curlew::detail
