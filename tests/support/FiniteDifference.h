// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/ScalarField.h"
#include "support/Points.h"

#include <algorithm>

namespace curlew::test {

template <int N = 3>
Vec<double, N> unit(int axis) {
    Vec<double, N> e;
    e[axis] = 1;
    return e;
}

/// Central differences of a function of position: an approximation of second order.
template <class Function, int N>
Vec<double, N> gradientFd(const Function& f, const Vec<double, N>& p, double h) {
    Vec<double, N> gradient;
    for (int axis = 0; axis < N; ++axis)
        gradient[axis] = (f(p + unit<N>(axis) * h) - f(p - unit<N>(axis) * h)) / (2 * h);
    return gradient;
}

inline double median(std::vector<double> v) {
    std::nth_element(v.begin(), v.begin() + static_cast<ptrdiff_t>(v.size() / 2), v.end());
    return v[v.size() / 2];
}

/// How far the analytic derivatives of a field are from central differences, the largest component at each point: of
/// the gradient from differences of the value, of the Hessian from differences of the gradient.
struct DerivativeErrors {
    std::vector<double> gradient, hessian;
    double worstGradient() const { return *std::max_element(gradient.begin(), gradient.end()); }
    double worstHessian() const { return *std::max_element(hessian.begin(), hessian.end()); }
};

/// `field`: a ScalarFieldN, or a noise: whatever has at<Order, double>(position).
template <class Field, int N>
DerivativeErrors derivativeErrors(const Field& field, const std::vector<Vec<double, N>>& points, double h) {
    using V = Vec<double, N>;
    DerivativeErrors errors;
    for (const V& p : points) {
        const auto jet = field.template at<2, double>(p);
        double first = 0, second = 0;
        const V g = gradientFd([&](const V& q) { return field.template at<0, double>(q).value; }, p, h);
        for (int j = 0; j < N; ++j) {
            first = std::max(first, std::abs(g[j] - jet.gradient[j]));
            const V row = (field.template at<1, double>(p + unit<N>(j) * h).gradient -
                           field.template at<1, double>(p - unit<N>(j) * h).gradient) *
                          (0.5 / h);
            for (int i = 0; i < N; ++i) second = std::max(second, std::abs(row[i] - jet.hessian(i, j)));
        }
        errors.gradient.push_back(first);
        errors.hessian.push_back(second);
    }
    return errors;
}

/// The order at which an error falls when what it depends on is halved.
inline double observedOrder(double error, double errorAtHalf) { return std::log2(error / errorAtHalf); }

/// Requires that central differences converge to the analytic derivatives of `field` with second order, up to an error
/// of `thirdDerivative` h²/6: were a derivative wrong, the difference would stay. Medians, because a field that is only
/// C² leaves an error of first order in the Hessian where the stencil straddles a seam. Call it with fields that are
/// not polynomials of second degree, on which central differences are exact.
template <class Field, int N>
void requireDerivatives(const Field& field, const std::vector<Vec<double, N>>& points, double h,
                        double thirdDerivative) {
    const DerivativeErrors at1 = derivativeErrors(field, points, h), at2 = derivativeErrors(field, points, h / 2);
    const double gradientOrder = observedOrder(median(at1.gradient), median(at2.gradient));
    const double hessianOrder = observedOrder(median(at1.hessian), median(at2.hessian));
    CAPTURE(h, median(at1.gradient), median(at2.gradient), median(at1.hessian), median(at2.hessian));
    CHECK(gradientOrder > 1.9);
    CHECK(gradientOrder < 2.1);
    CHECK(hessianOrder > 1.9);
    CHECK(hessianOrder < 2.1);
    CHECK(at2.worstGradient() <= thirdDerivative * h * h / 24);
    // Across a seam of the second derivatives the error is of first order: at most the third derivative times h.
    CHECK(at2.worstHessian() <= thirdDerivative * h);
}

/// How far the analytic third derivatives of a field are from central differences of its Hessian, the largest component
/// at each point.
template <class Field, int N>
std::vector<double> thirdDerivativeErrors(const Field& field, const std::vector<Vec<double, N>>& points, double h) {
    std::vector<double> errors;
    for (const auto& p : points) {
        const auto third = field.template at<3, double>(p).third;
        double worst = 0;
        for (int k = 0; k < N; ++k) {
            const auto up = field.template at<2, double>(p + unit<N>(k) * h).hessian;
            const auto down = field.template at<2, double>(p - unit<N>(k) * h).hessian;
            for (int i = 0; i < N; ++i)
                for (int j = i; j < N; ++j) {
                    const double error = std::abs((up(i, j) - down(i, j)) / (2 * h) - third(i, j, k));
                    if (!(error <= worst)) worst = error;
                }
        }
        errors.push_back(worst);
    }
    return errors;
}

/// Requires that central differences of the Hessian converge to the analytic third derivatives of `field` with second
/// order, in the median and at each point: were one wrong, the difference would stay. `seams`: the share of the points
/// that are let off, because third derivatives jump within the stencil. Call it with fields that are not polynomials of
/// fourth degree, on which central differences are exact.
template <class Field, int N>
void requireThirdDerivatives(const Field& field, const std::vector<Vec<double, N>>& points, double h,
                             double seams = 0) {
    const auto at1 = thirdDerivativeErrors(field, points, h), at2 = thirdDerivativeErrors(field, points, h / 2);
    const double typical = median(at1), order = observedOrder(typical, median(at2));
    // A quarter is left, and a hundredth of the median where the leading term of the error happens to vanish.
    double stuck = 0;
    for (size_t k = 0; k < points.size(); ++k) stuck += !(at2[k] <= 0.3 * at1[k] + 0.01 * typical);
    CAPTURE(h, typical, median(at2), stuck, points.size());
    CHECK(order > 1.9);
    CHECK(order < 2.1);
    CHECK(stuck <= seams * static_cast<double>(points.size()));
}

/// What changes, by order of the derivative, between points `step` before and behind a surface.
struct Jumps {
    std::array<double, 4> largest{};
    size_t seen = 0;
};

/// Of `field` across the surface where `level` is zero, on lines between random points of the box: for a field that is
/// C^k the first k + 1 are at most 2 `step` times the next derivative.
template <int N>
Jumps jumpsAcross(const ScalarFieldN<N>& field, const ScalarFieldN<N>& level, const BoxN<N>& box, double step,
                  uint64_t seed) {
    Jumps jumps;
    for (uint64_t k = 0; k < 300; ++k) {
        Vec<double, N> p = randomPoint(box, seed, 2 * k), q = randomPoint(box, seed, 2 * k + 1);
        const double atP = level.template at<0>(p).value;
        if (!(atP * level.template at<0>(q).value < 0)) continue;
        const Vec<double, N> way = (q - p) * (1 / length(q - p));
        for (int halving = 0; halving < 60; ++halving) {
            const Vec<double, N> middle = (p + q) * 0.5;
            (level.template at<0>(middle).value * atP > 0 ? p : q) = middle;
        }
        ++jumps.seen;
        const auto a = field.template at<3>(p - way * step), b = field.template at<3>(p + way * step);
        using J = std::remove_cv_t<decltype(a)>;
        const std::array<int, 5> ends{0, 1, J::kHessian, J::kThird, J::kSize};
        for (size_t order = 0; order < 4; ++order) {
            const double jump = difference(a, b, ends[order], ends[order + 1]);
            if (!(jump <= jumps.largest[order])) jumps.largest[order] = jump;
        }
    }
    return jumps;
}

} // namespace curlew::test
