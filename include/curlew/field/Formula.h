// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/ScalarField.h"
#include "curlew/math/Symbol.h"

#include <type_traits>

namespace curlew {

// Formulas add numbers to jets. A number would need two conversions to become a jet of symbols.
template <class T, int N, int Order, class Number>
requires std::is_arithmetic_v<Number> Jet<Symbol<T>, N, Order>
operator+(const Jet<Symbol<T>, N, Order>& a, Number b) { return a + Jet<Symbol<T>, N, Order>(Symbol<T>(b)); }
template <class T, int N, int Order, class Number>
requires std::is_arithmetic_v<Number> Jet<Symbol<T>, N, Order>
operator+(Number a, const Jet<Symbol<T>, N, Order>& b) { return Jet<Symbol<T>, N, Order>(Symbol<T>(a)) + b; }
template <class T, int N, int Order, class Number>
requires std::is_arithmetic_v<Number> Jet<Symbol<T>, N, Order>
operator-(const Jet<Symbol<T>, N, Order>& a, Number b) { return a - Jet<Symbol<T>, N, Order>(Symbol<T>(b)); }
template <class T, int N, int Order, class Number>
requires std::is_arithmetic_v<Number> Jet<Symbol<T>, N, Order>
operator-(Number a, const Jet<Symbol<T>, N, Order>& b) { return Jet<Symbol<T>, N, Order>(Symbol<T>(a)) - b; }

/// A pointwise model made of a formula. The formula is evaluated on jets of the coordinates, which differentiate it
/// automatically: `formula(x)`, where x is a Vec of N jets, or `formula(x, k)`, where k turns constants into jets. A
/// formula with kernels must support lanes and declares `static constexpr bool kHasKernels = true`.
template <int N, class F>
struct Formula {
    static constexpr int kDimension = N;
    static constexpr bool kHasKernels = N == 3 && LaneModel<F>;
    F formula;
    template <int Order, class T>
    Jet<T, N, Order> at(const Vec<Rebind<T, double>, N>& p) const {
        using J = Jet<T, N, Order>;
        Vec<T, N> x;
        for (int i = 0; i < N; ++i) x[i] = convertTo<T>(p[i]);
        const auto constant = [](double c) { return J(static_cast<T>(c)); };
        if constexpr (requires { formula(J::variables(x), constant); })
            return formula(J::variables(x), constant);
        else
            return formula(J::variables(x));
    }
};

template <int N = 3, class F>
ScalarFieldN<N> formulaField(F formula) {
    return ScalarFieldN<N>(Formula<N, F>{std::move(formula)});
}

} // namespace curlew
