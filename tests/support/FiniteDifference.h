#pragma once

#include "curlew/field/ScalarField.h"
#include "support/Points.h"

#include <algorithm>

namespace curlew::test {

inline Vec3d unit(int axis) {
    Vec3d e;
    e[axis] = 1;
    return e;
}

/// Central differences of a function of position: an approximation of second order.
template <class Function>
Vec3d gradientFd(const Function& f, const Vec3d& p, double h) {
    Vec3d gradient;
    for (int axis = 0; axis < 3; ++axis) gradient[axis] = (f(p + unit(axis) * h) - f(p - unit(axis) * h)) / (2 * h);
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

inline DerivativeErrors derivativeErrors(const ScalarField& field, const std::vector<Vec3d>& points, double h) {
    DerivativeErrors errors;
    for (const Vec3d& p : points) {
        const auto jet = field.at<2>(p);
        double first = 0, second = 0;
        const Vec3d g = gradientFd([&](const Vec3d& q) { return field.at<0>(q).value; }, p, h);
        for (int j = 0; j < 3; ++j) {
            first = std::max(first, std::abs(g[j] - jet.gradient[j]));
            const Vec3d row =
                (field.at<1>(p + unit(j) * h).gradient - field.at<1>(p - unit(j) * h).gradient) * (0.5 / h);
            for (int i = 0; i < 3; ++i) second = std::max(second, std::abs(row[i] - jet.hessian(i, j)));
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
inline void requireDerivatives(const ScalarField& field, const std::vector<Vec3d>& points, double h,
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
