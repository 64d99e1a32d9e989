// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Flow.h"
#include "support/FiniteDifference.h"
#include "support/Samples.h"

namespace curlew::test {

template <int N>
double trace(const Matrix<N, N>& m) {
    double sum = 0;
    for (int i = 0; i < N; ++i) sum += m[i][i];
    return sum;
}

template <int N>
double frobenius(const Matrix<N, N>& m) {
    double sum = 0;
    for (const auto& row : m.rows) sum += dot(row, row);
    return std::sqrt(sum);
}

/// The size of the products that the derivative of a flow is a sum of: the Hessian of one potential times the gradients
/// of all others.
template <int N>
double productsIn(const FlowN<N>& flow, const Vec<double, N>& p) {
    double sum = 0;
    for (const auto& term : flow.terms()) {
        double gradients = 1, hessians = 0; // the product, and its derivative by the product rule
        for (const auto& potential : term) {
            const auto jet = potential.template at<2>(p);
            double squares = 0;
            for (int i = 0; i < N; ++i)
                for (int j = 0; j < N; ++j) squares += jet.hessian(i, j) * jet.hessian(i, j);
            const double gradient = length(jet.gradient);
            hessians = hessians * gradient + gradients * std::sqrt(squares);
            gradients *= gradient;
        }
        sum += hessians;
    }
    return sum;
}

/// The divergence of a flow at random points: the trace of its derivative against the size of the derivative.
template <int N>
struct DivergenceN {
    WorstN<N> worst;
    size_t still = 0; ///< Points where the derivative is so small that its trace is the rounding of larger products.
};
template <int N>
DivergenceN<N> divergenceOf(const FlowN<N>& flow, const BoxN<N>& box, size_t count, uint64_t seed) {
    DivergenceN<N> result;
    for (uint64_t k = 0; k < count; ++k) {
        const auto p = randomPoint(box, seed, k);
        const Matrix<N, N> derivative = flow.at(p).derivative;
        const double size = frobenius(derivative), divergence = std::abs(trace(derivative));
        // Gradients can be parallel or zero in whole regions: where two noises hang on a vertex with the same gradient,
        // in the gaps of a noise, or where a flow has been stopped.
        if (!(divergence <= 1e-9 * size) && divergence <= 8 * 0x1p-53 * productsIn(flow, p))
            ++result.still;
        else
            result.worst.see(size > 0 ? divergence / size : size, p);
    }
    return result;
}

/// The same without the derivatives: central differences of the velocity, root mean square over random points, relative
/// to that of the derivative. The trace above vanishes by the symmetry of any Hessians; this one only if the gradients
/// are those of functions.
template <int N>
double divergenceFd(const FlowN<N>& flow, const BoxN<N>& box, size_t count, uint64_t seed, double h) {
    double divergences = 0, sizes = 0;
    for (uint64_t k = 0; k < count; ++k) {
        const auto p = randomPoint(box, seed, k);
        PointBatchN<N> around;
        for (int axis = 0; axis < N; ++axis)
            for (const double sign : {1.0, -1.0}) around.push(p + unit<N>(axis) * (sign * h));
        VecBatchN<double, N> c;
        flow.velocity(around, c);
        double sum = 0;
        for (int axis = 0; axis < N; ++axis) {
            const auto column = (c[2 * axis] - c[2 * axis + 1]) * (0.5 / h);
            sum += column[axis];
            sizes += dot(column, column);
        }
        divergences += sum * sum;
    }
    return std::sqrt(divergences / sizes);
}

struct DivergenceOptions {
    size_t count = 10000; ///< Points.
    double still = 0.001; ///< The largest part of them at which the trace may be no better than its rounding.
    /// What central differences may be off by. Their error is of second order: (h/l)²/6 for a flow of wavelength
    /// 2 pi l. The smallest l here is about 1/90, where layers of 0.15 turn within a third of their width, at 2^-13
    /// 1.2e-4 / 6; where a second derivative jumps, it is of first order, but in a part of space that is as small as h.
    /// A wrong gradient would leave an error of the size of its part in the velocity.
    double differences = 2e-5;
    double step = 0x1p-13; ///< h.
};

/// Both.
template <int N>
void requireDivergenceFree(const FlowN<N>& flow, const BoxN<N>& box, const DivergenceOptions& options = {}) {
    const size_t count = samples(options.count);
    const DivergenceN<N> divergence = divergenceOf(flow, box, count, 1);
    const double differences = divergenceFd(flow, box, std::min<size_t>(count, 3000), 2, options.step);
    CAPTURE(divergence.worst.value, divergence.worst.where, divergence.still, differences);
    CHECK(divergence.worst.value <= 1e-9);
    CHECK(static_cast<double>(divergence.still) <= options.still * static_cast<double>(count));
    CHECK(differences < options.differences);
    CHECK(flow.divergenceFree());
}

/// Requires that the derivative of a flow is that of its velocity: central differences converge to it with second
/// order.
template <int N>
void requireJacobian(const FlowN<N>& flow, const BoxN<N>& box, size_t count, uint64_t seed, double h = 0x1p-10) {
    const auto errors = [&](double step) {
        std::vector<double> worst;
        for (const auto& p : randomPoints(box, count, seed)) {
            const Matrix<N, N> derivative = flow.at(p).derivative;
            double error = 0;
            for (int j = 0; j < N; ++j) {
                const auto column =
                    (flow.at(p + unit<N>(j) * step).velocity - flow.at(p - unit<N>(j) * step).velocity) * (0.5 / step);
                for (int i = 0; i < N; ++i) error = std::max(error, std::abs(column[i] - derivative[i][j]));
            }
            worst.push_back(error / (1 + frobenius(derivative)));
        }
        return median(worst);
    };
    const double coarse = errors(h), fine = errors(h / 2), order = observedOrder(coarse, fine);
    CAPTURE(coarse, fine, order);
    CHECK(order > 1.9);
    CHECK(order < 2.1);
}

} // namespace curlew::test
