#pragma once

#include "curlew/field/Algebra.h"
#include "curlew/field/Formula.h"
#include "curlew/field/Map.h"

namespace curlew::test {

template <int N = 3, class F>
ScalarFieldN<N> formula(F f) {
    return formulaField<N>(std::move(f));
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
