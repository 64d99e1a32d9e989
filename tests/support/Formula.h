#pragma once

#include "curlew/field/Algebra.h"

namespace curlew::test {

/// A user-defined pointwise model: a formula on coordinates that are jets.
template <class F>
struct Formula {
    F formula;
    template <int Order, class T>
    Jet<T, 3, Order> at(const Vec3d& p) const {
        using J = Jet<T, 3, Order>;
        return formula(Vec<J, 3>{{J::variable(static_cast<T>(p[0]), 0), J::variable(static_cast<T>(p[1]), 1),
                                  J::variable(static_cast<T>(p[2]), 2)}});
    }
};

template <class F>
ScalarField formula(F f) {
    return ScalarField(Formula<F>{std::move(f)});
}

/// Two analytic fields without symmetries, of wavelengths from 2 to 6, |value| <= 3.
inline ScalarField sinesF() {
    return formula([](const auto& x) { return sin(x[0] + x[1] * 2) + sin(x[1] - x[2] * 3) + cos(x[2] + x[0] * 2); });
}
inline ScalarField sinesG() {
    return formula([](const auto& x) { return cos(x[0] - x[2]) * sin(x[1] * 2 + x[0]) + sin(x[2] * 2 - x[1]) * 2; });
}

inline Placement moved(const Vec3d& offset) { return {.offset = offset}; }

} // namespace curlew::test
