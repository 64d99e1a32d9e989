// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "AlgebraModels.h"

#include <cmath>

namespace curlew::detail {

/// The functions of one variable in formulas. Those with a parameter name it.
enum class Function {
    sin,
    cos,
    tan,
    asin,
    acos,
    atan,
    sinh,
    cosh,
    tanh,
    exp,
    log,
    sqrt, ///< Zero, with zero derivatives, at zero.
    abs,
    shift,      ///< v + first
    power,      ///< v^first, for v > 0
    wholePower, ///< v^first for a whole number; v must not be zero if that is negative
    smoothstep, ///< The quintic fade of (v - first) * second
};

/// Applies a function of one variable to a jet. The switch is outside the work on lanes.
struct FunctionMap {
    Function function;
    double first = 0, second = 0;

    template <class J>
    J operator()(const J& p) const {
        if (function == Function::shift) {
            J moved = p;
            moved.value += static_cast<ValueOf<J>>(first);
            return moved;
        }
        return compose(p, at(p.value));
    }

  private:
    template <class T>
    Univariate<T> at(const T& v) const {
        const T one(1), two(2);
        switch (function) {
            case Function::sin: {
                const T s = sin(v), c = cos(v);
                return {s, c, -s, -c};
            }
            case Function::cos: {
                const T s = sin(v), c = cos(v);
                return {c, -s, -c, s};
            }
            case Function::tan: {
                const T t = sin(v) / cos(v), slope = mulAdd(t, t, one);
                return {t, slope, two * t * slope, two * slope * mulAdd(T(3) * t, t, one)};
            }
            case Function::asin:
            case Function::acos: {
                const T slope = one / sqrt(negMulAdd(v, v, one)), cube = slope * slope * slope;
                const T third = cube * mulAdd(T(3) * v * v, slope * slope, one);
                if (function == Function::asin) return {asin(v), slope, v * cube, third};
                return {acos(v), -slope, -v * cube, -third};
            }
            case Function::atan: {
                const T slope = one / mulAdd(v, v, one), square = slope * slope;
                return {atan(v), slope, T(-2) * v * square, mulAdd(T(6) * v, v, T(-2)) * square * slope};
            }
            case Function::sinh:
            case Function::cosh: {
                const T s = sinh(v);
                const T c = cosh(v);
                return function == Function::sinh ? Univariate<T>{s, c, s, c} : Univariate<T>{c, s, c, s};
            }
            case Function::tanh: {
                const T t = tanh(v), slope = negMulAdd(t, t, one);
                return {t, slope, T(-2) * t * slope, slope * mulAdd(T(6) * t, t, T(-2))};
            }
            case Function::exp: {
                const T e = exp(v);
                return {e, e, e, e};
            }
            case Function::log: {
                const T r = one / v;
                return {log(v), r, -r * r, two * r * r * r};
            }
            case Function::sqrt: {
                const T root = sqrt(v), inverse = select(v > T(0), one / v, T(0));
                const T slope = T(0.5) * root * inverse, bend = T(-0.5) * slope * inverse;
                return {root, slope, bend, T(-1.5) * bend * inverse};
            }
            case Function::abs: {
                const T sign = select(v < T(0), T(-1), one);
                return {abs(v), sign, T(0), T(0)};
            }
            case Function::power: {
                const auto n = static_cast<NumberOf<T>>(first);
                const T r = one / v, value = pow(v, n);
                const T slope = T(n) * value * r, bend = T(n - 1) * slope * r;
                return {value, slope, bend, T(n - 2) * bend * r};
            }
            case Function::wholePower:
                return wholePowerOf(v);
            case Function::smoothstep: {
                const auto scale = static_cast<T>(second);
                const Univariate<T> f = quinticFade((v - static_cast<T>(first)) * scale);
                return {f.value, scale * f.first, scale * scale * f.second, scale * scale * scale * f.third};
            }
            case Function::shift:
                break;
        }
        return {v, one, T(0), T(0)};
    }

    template <class T>
    Univariate<T> wholePowerOf(const T& v) const {
        const int n = static_cast<int>(first);
        const T base = n < 0 ? T(1) / v : v;
        const auto raised = [&base](int times) {
            T product(1);
            for (int k = 0; k < times; ++k) product *= base;
            return product;
        };
        // The k-th derivative is n (n - 1) … (n - k + 1) v^(n - k).
        Univariate<T> all;
        const std::array<T*, 4> parts{&all.value, &all.first, &all.second, &all.third};
        double factor = 1;
        for (int k = 0; k <= 3; ++k) {
            *parts[static_cast<size_t>(k)] =
                factor == 0 ? T(0) : static_cast<T>(factor) * raised(n < 0 ? k - n : n - k);
            factor *= n - k;
        }
        return all;
    }
};

} // namespace curlew::detail
