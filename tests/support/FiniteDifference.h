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

} // namespace curlew::test
