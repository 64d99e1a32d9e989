#pragma once

#include "curlew/field/Formula.h"

#include <numbers>

namespace curlew::detail {

// Signed distances, as formulas on coordinates that are jets.

/// The root of a sum of squares; zero, without derivatives, where the sum is zero.
template <class J>
J norm(const J& squares) {
    return select(squares.value > decltype(squares.value)(0), sqrt(squares), J());
}

struct Sphere {
    static constexpr bool kHasKernels = true;
    double radius;
    template <class X, class K>
    auto operator()(const X& p, const K& k) const {
        return norm(dot(p, p)) - k(radius);
    }
};

struct RoundedBox {
    static constexpr bool kHasKernels = true;
    Vec3d inner; ///< Half its edges, without what rounding takes.
    double rounding;
    template <class X, class K>
    auto operator()(const X& p, const K& k) const {
        const auto zero = k(0);
        auto squares = zero, deepest = abs(p[0]) - k(inner[0]);
        for (int i = 0; i < 3; ++i) {
            const auto q = abs(p[i]) - k(inner[i]), out = max(q, zero);
            squares = squares + out * out;
            deepest = max(deepest, q);
        }
        return select(deepest.value > zero.value, norm(squares), deepest) - k(rounding);
    }
};

struct Torus {
    static constexpr bool kHasKernels = true;
    double radius, tube;
    template <class X, class K>
    auto operator()(const X& p, const K& k) const {
        const auto ring = norm(p[0] * p[0] + p[2] * p[2]) - k(radius);
        return norm(ring * ring + p[1] * p[1]) - k(tube);
    }
};

struct Capsule {
    static constexpr bool kHasKernels = true;
    double length, radius;
    template <class X, class K>
    auto operator()(const X& p, const K& k) const {
        const auto beyond = max(abs(p[1]) - k(length / 2), k(0));
        return norm(p[0] * p[0] + beyond * beyond + p[2] * p[2]) - k(radius);
    }
};

struct Gyroid {
    static constexpr bool kHasKernels = true;
    double wavelength, thickness;
    template <class X, class K>
    auto operator()(const X& p, const K& c) const {
        const double k = 2 * std::numbers::pi / wavelength;
        // sin x cos y + sin y cos z + sin z cos x has a gradient of at most √3 in these coordinates (at the origin).
        const double scale = 1 / (std::numbers::sqrt3 * k);
        const auto x = p[0] * c(k), y = p[1] * c(k), z = p[2] * c(k);
        return abs(sin(x) * cos(y) + sin(y) * cos(z) + sin(z) * cos(x)) * c(scale) - c(thickness / 2);
    }
};

} // namespace curlew::detail
