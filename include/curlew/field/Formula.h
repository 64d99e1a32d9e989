#pragma once

#include "curlew/field/ScalarField.h"

namespace curlew {

/// A pointwise model from a formula on coordinates that are jets, which differentiate it: `formula(x)`, x a Vec of N
/// jets; or `formula(x, k)`, where k turns constants into jets.
template <int N, class F>
struct Formula {
    F formula;
    template <int Order, class T>
    Jet<T, N, Order> at(const Vec<double, N>& p) const {
        using J = Jet<T, N, Order>;
        Vec<T, N> x;
        for (int i = 0; i < N; ++i) x[i] = static_cast<T>(p[i]);
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
