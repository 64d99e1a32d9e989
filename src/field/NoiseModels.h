// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Error.h"
#include "curlew/field/NoiseField.h"

#include <algorithm>
#include <vector>

namespace curlew::detail {

template <class Noise>
struct Octave {
    Noise noise;
    double frequency, amplitude;
    double weight; ///< Of its gradient, in the displacement of the octaves after it.
};

template <class Noise>
Interval rangeOf(const Noise& noise) {
    if constexpr (requires { noise.range(); })
        return noise.range();
    else
        return Interval::within(noise.maxAbs());
}

/// Returns the jet of a f(s x) in x, given the jet of f at s x.
template <class T, int N, int Order>
Jet<T, N, Order> dilated(Jet<T, N, Order> f, NumberOf<T> a, NumberOf<T> s) {
    f.value *= T(a);
    if constexpr (Order >= 1) f.gradient *= T(a * s);
    if constexpr (Order >= 2)
        for (T& h : f.hessian.c) h *= T(a * s * s);
    if constexpr (Order >= 3)
        for (T& t : f.third.c) t *= T(a * s * s * s);
    return f;
}

/// Returns a rounded |n|.
template <class J>
J folded(const J& n, double fold) {
    using T = std::remove_cvref_t<decltype(n.value)>;
    const auto rounding = static_cast<T>(fold);
    return sqrt(n * n + J(rounding * rounding)) - J(rounding);
}

template <class Noise, int N = Noise::kDimension>
struct Octaves {
    static constexpr int kDimension = N;
    static constexpr bool kHasKernels = true;
    std::vector<Octave<Noise>> octaves;
    double billow;

    template <int Order, class T>
    void evalBatch(const PointBatchN<N>& points, JetBatchN<NumberOf<T>, N, Order>& jets) const {
        // One octave at a time, so its data stays in registers.
        for (const auto& o : octaves)
            for (int i = 0; i < points.size; i += kLanes<T>) {
                const auto n = octaveAt<Order, T>(o, points.template lanes<Rebind<T, double>>(i));
                jets.set(i, &o == octaves.data() ? n : jets.template lanes<T>(i) + n);
            }
    }
    template <int Order>
    Jet<Symbol<float>, N, Order> symbols(SymbolModule&, const Vec<Symbol<double>, N>& p) const {
        Jet<Symbol<float>, N, Order> sum;
        for (const auto& o : octaves) {
            const auto noise = [&o](const Vec<Symbol<double>, N>& x) {
                return o.noise.template at<Order, Symbol<float>>(x);
            };
            const Vec<Symbol<double>, N> x = p * Symbol<double>(o.frequency);
            sum += shaped(o, outlined<Jet<Symbol<float>, N, Order>>("noise", noise, x));
        }
        return sum;
    }
    Interval range() const {
        Interval sum{0, 0};
        for (const auto& o : octaves) {
            const Interval n = rangeOf(o.noise);
            const double most = std::sqrt(n.maxAbs() * n.maxAbs() + billow * billow) - billow;
            sum = sum + o.amplitude * (billow > 0 ? Interval{0, most} : n);
        }
        return sum;
    }
    /// Billow bends the noise sharply at its zeros, which few random places are near.
    bool homogeneous() const { return billow == 0; }
    /// Returns the cell size of the octave with the lowest frequency.
    double wavelength() const {
        double longest = 0;
        for (const auto& o : octaves) longest = std::max(longest, 1 / o.frequency);
        return longest;
    }

  private:
    template <int Order, class T>
    Jet<T, N, Order> octaveAt(const Octave<Noise>& o, const Vec<Rebind<T, double>, N>& p) const {
        return shaped(o, o.noise.template at<Order, T>(p * Rebind<T, double>(o.frequency)));
    }
    /// Returns the octave in world units, given the jet of its noise.
    template <class T, int Order>
    Jet<T, N, Order> shaped(const Octave<Noise>& o, Jet<T, N, Order> n) const {
        using Number = NumberOf<T>;
        if (billow > 0) n = folded(n, billow);
        return dilated(n, static_cast<Number>(o.amplitude), static_cast<Number>(o.frequency));
    }
};

/// Octaves displaced by the gradients of the octaves before them (a domain warp). The derivatives of a displacement are
/// those of a gradient, so every octave is evaluated with one order more. Everything is computed in double.
template <class Noise, int N = Noise::kDimension>
struct WarpedOctaves {
    Octaves<Noise> plain;
    double warp;
    Vec<double, N> period; ///< World units; 0 if it does not tile.

    template <int Order, class T>
    Jet<T, N, Order> at(const Vec<double, N>& p) const {
        if constexpr (Order >= 3) {
            throw ValueError("a noise with warp cannot displace another field: its third derivatives are not known");
        } else {
            const Jet<double, N, Order> sum = sumAt<Order>(p);
            Jet<T, N, Order> rounded;
            for (int k = 0; k < sum.kSize; ++k) rounded.component(k) = static_cast<T>(sum.component(k));
            return rounded;
        }
    }
    /// The same, with displacements in the precision of values.
    template <int Order>
    Jet<Symbol<float>, N, Order> symbols(SymbolModule&, const Vec<Symbol<double>, N>& p) const {
        using S = Symbol<float>;
        using J = Jet<S, N, Order>;
        J sum;
        Vec<J, N> pull;
        Vec<Symbol<double>, N> tile = p;
        for (int i = 0; i < N; ++i)
            if (period[i] > 0) tile[i] -= Symbol<double>(period[i]) * floor(p[i] / Symbol<double>(period[i]));
        for (const auto& o : plain.octaves) {
            Vec<J, N> y; // its value is the displacement only
            Vec<Symbol<double>, N> position;
            for (int i = 0; i < N; ++i) {
                y[i] = J::variable(S(0), i) * S(o.frequency) + pull[i] * S(warp);
                position[i] = mulAdd(tile[i], Symbol<double>(o.frequency), convertTo<Symbol<double>>(y[i].value));
            }
            const auto noise = [&o](const Vec<Symbol<double>, N>& x) { return o.noise.template at<2, S>(x); };
            if constexpr (Order >= 2) {
                throw ValueError("a noise with warp cannot displace another field in a shader");
            } else {
                const auto n = outlined<Jet<S, N, 2>>("noise", noise, position);
                J octave = compose(truncated<Order>(n), y);
                if (plain.billow > 0) octave = folded(octave, plain.billow);
                sum += octave * S(o.amplitude);
                for (int i = 0; i < N; ++i) pull[i] += compose(partial(n, i), y) * S(o.weight);
            }
        }
        return sum;
    }
    Interval range() const { return plain.range(); }
    double wavelength() const { return plain.wavelength(); }

  private:
    /// Not inlined, so that both precisions of the result share it.
    template <int Order>
    [[gnu::noinline]] Jet<double, N, Order> sumAt(const Vec<double, N>& p) const {
        using J = Jet<double, N, Order>;
        J sum;
        Vec<J, N> pull; // sum of the gradients of the octaves so far
        Vec<double, N> tile = p;
        for (int i = 0; i < N; ++i)
            if (period[i] > 0) tile[i] -= period[i] * std::floor(p[i] / period[i]);
        const auto x = J::variables(tile);
        for (const auto& o : plain.octaves) {
            Vec<J, N> y;
            Vec<double, N> position;
            for (int i = 0; i < N; ++i) {
                y[i] = x[i] * o.frequency + pull[i] * warp;
                position[i] = y[i].value;
            }
            const auto n = o.noise.template at<Order + 1, double>(position);
            J octave = compose(truncated<Order>(n), y);
            if (plain.billow > 0) octave = folded(octave, plain.billow);
            sum += octave * o.amplitude;
            for (int i = 0; i < N; ++i) pull[i] += compose(partial(n, i), y) * o.weight;
        }
        return sum;
    }
};

} // namespace curlew::detail
