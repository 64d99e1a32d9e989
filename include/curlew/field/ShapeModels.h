// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Require.h"
#include "curlew/field/Formula.h"
#include "curlew/field/Shapes.h"

#include <algorithm>
#include <numbers>

/// The shapes. Each has its sizes as members; `check()`, which throws ValueError if a size is out of range; `bounds()`,
/// a box that contains the inside; and its signed distance as a formula on jets p of the coordinates, where k turns
/// constants into jets. The distance of a NaN position is NaN. A formula that is only a lower bound on the distance
/// declares `static constexpr double kReach = 0` (SdfN::reach). Units are world units. A new shape must also be added
/// to CURLEW_SHAPES below.
namespace curlew::shapes {

/// Returns the root of a sum of squares; zero, with zero derivatives, where the sum is zero. A NaN stays NaN.
template <class J>
J norm(const J& squares) {
    return select(squares.value == decltype(squares.value)(0), J(), sqrt(squares));
}

/// Returns norm(squares) outside, where one of the coordinates whose squares are summed is positive, and inside the
/// largest of these coordinates. Both are negative or zero inside, so the sum is zero there; it is NaN if one is NaN.
template <class J>
J outsideOrDeepest(const J& squares, const J& deepest) {
    const decltype(deepest.value) zero(0);
    return select((deepest.value <= zero) & (squares.value == zero), deepest, norm(squares));
}

template <int N>
BoxN<N> boxOfSize(const Vec<double, N>& size) {
    return {size * -0.5, size * 0.5};
}
template <int N = 3>
BoxN<N> everywhere() {
    return BoxN<N>{}.padded(std::numeric_limits<double>::infinity());
}

/// See sphereSdf().
struct Sphere {
    static constexpr bool kHasKernels = true;
    double radius;
    void check() const { requirePositive(radius, "radius"); }
    Box bounds() const { return Box{}.padded(radius); }
    template <class X, class K>
    auto operator()(const X& p, const K& k) const {
        return norm(dot(p, p)) - k(radius);
    }
};

/// See boxSdf().
template <int N>
struct RoundedBox {
    static constexpr bool kHasKernels = true;
    Vec<double, N> size;
    double rounding;
    void check() const {
        for (const double edge : size.c) requirePositive(edge, "size");
        const double shortest = *std::min_element(size.c.begin(), size.c.end());
        if (!(rounding >= 0) || rounding > shortest / 2)
            throw ValueError(
                fmt::format("rounding {} must lie between 0 and half the shortest edge, {}", rounding, shortest / 2));
    }
    BoxN<N> bounds() const { return boxOfSize(size); }
    template <class X, class K>
    auto operator()(const X& p, const K& k) const {
        const auto zero = k(0);
        const auto beyond = [&](int i) { return abs(p[i]) - k(size[i] * 0.5 - rounding); };
        auto squares = zero, deepest = beyond(0);
        for (int i = 0; i < N; ++i) {
            const auto q = beyond(i), out = max(q, zero);
            squares = squares + out * out;
            deepest = max(deepest, q);
        }
        return outsideOrDeepest(squares, deepest) - k(rounding);
    }
};

/// See torusSdf().
struct Torus {
    static constexpr bool kHasKernels = true;
    double radius, tube;
    void check() const {
        requirePositive(radius, "radius");
        requirePositive(tube, "tube");
        if (tube >= radius) throw ValueError(fmt::format("tube {} must be below the radius {}", tube, radius));
    }
    Box bounds() const { return boxOfSize<3>({{2 * (radius + tube), 2 * tube, 2 * (radius + tube)}}); }
    template <class X, class K>
    auto operator()(const X& p, const K& k) const {
        const auto ring = norm(p[0] * p[0] + p[2] * p[2]) - k(radius);
        return norm(ring * ring + p[1] * p[1]) - k(tube);
    }
};

/// See capsuleSdf().
struct Capsule {
    static constexpr bool kHasKernels = true;
    double length, radius;
    void check() const {
        requirePositive(length, "length");
        requirePositive(radius, "radius");
    }
    Box bounds() const { return boxOfSize<3>({{2 * radius, length + 2 * radius, 2 * radius}}); }
    template <class X, class K>
    auto operator()(const X& p, const K& k) const {
        const auto beyond = max(abs(p[1]) - k(length / 2), k(0));
        return norm(p[0] * p[0] + beyond * beyond + p[2] * p[2]) - k(radius);
    }
};

/// A cylinder along the y axis, with rounded edges: exact, as the distance in the plane of the radius and y from a
/// rectangle with rounded corners (RoundedBox). `length` and `radius` include the rounding.
struct Cylinder {
    static constexpr bool kHasKernels = true;
    double length, radius, rounding;
    void check() const {
        requirePositive(length, "length");
        requirePositive(radius, "radius");
        const double most = std::min(length / 2, radius);
        if (!(rounding >= 0) || rounding > most)
            throw ValueError(
                fmt::format("rounding {} must lie between 0 and the smaller of the radius and half the length, {}",
                            rounding, most));
    }
    Box bounds() const { return boxOfSize<3>({{2 * radius, length, 2 * radius}}); }
    template <class X, class K>
    auto operator()(const X& p, const K& k) const {
        const auto zero = k(0), side = norm(p[0] * p[0] + p[2] * p[2]) - k(radius - rounding),
                   cap = abs(p[1]) - k(length / 2 - rounding);
        const auto deepest = max(side, cap), besideIt = max(side, zero), aboveIt = max(cap, zero);
        return outsideOrDeepest(besideIt * besideIt + aboveIt * aboveIt, deepest) - k(rounding);
    }
};

/// See gyroidSdf().
struct Gyroid {
    static constexpr bool kHasKernels = true;
    static constexpr double kReach = 0;
    double wavelength, thickness;
    void check() const {
        requirePositive(wavelength, "wavelength");
        requirePositive(thickness, "thickness");
    }
    Box bounds() const { return everywhere(); }
    template <class X, class K>
    auto operator()(const X& p, const K& c) const {
        const double k = 2 * std::numbers::pi / wavelength;
        // The gradient of sin x cos y + sin y cos z + sin z cos x in these coordinates is at most √3 (at the origin).
        const double scale = 1 / (std::numbers::sqrt3 * k);
        const auto x = p[0] * c(k), y = p[1] * c(k), z = p[2] * c(k);
        return abs(sin(x) * cos(y) + sin(y) * cos(z) + sin(z) * cos(x)) * c(scale) - c(thickness / 2);
    }
};

/// DO(Shape) for each shape. sdfOf() and the kernels on lanes are instantiated for this list.
#define CURLEW_SHAPES(DO) DO(Sphere) DO(RoundedBox<3>) DO(Torus) DO(Capsule) DO(Cylinder) DO(Gyroid)

} // namespace curlew::shapes

namespace curlew {

/// Returns the signed distance of one of the shapes above. Throws ValueError if a size is out of range.
template <class Shape>
Sdf sdfOf(const Shape& shape);

} // namespace curlew
