// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/ScalarField.h"

#include <cmath>

namespace curlew::detail {

/// field(A (x - origin)).
template <int M, int N>
struct Affine {
    static constexpr int kDimension = N;
    static constexpr bool kHasKernels = M == 3 && N == 3;
    ScalarFieldN<M> field;
    Matrix<M, N> A;
    Vec<double, N> origin;
    template <int Order, class T>
    void evalBatch(const PointBatchN<N>& points, JetBatchN<NumberOf<T>, N, Order>& jets) const {
        using Position = Rebind<T, double>;
        PointBatchN<M> moved;
        moved.size = points.size;
        for (int i = 0; i < points.size; i += kLanes<T>) moved.set(i, mapped(points.template lanes<Position>(i)));
        JetBatchN<NumberOf<T>, M, Order> there;
        field.eval(moved, there);
        for (int i = 0; i < points.size; i += kLanes<T>) jets.set(i, pullBack(there.template lanes<T>(i), A));
    }
    template <int Order>
    Jet<Symbol<float>, N, Order> symbols(SymbolModule& module, const Vec<Symbol<double>, N>& p) const {
        return pullBack(field.template symbols<Order>(module, mapped(p)), A);
    }
    Interval range() const { return field.range(); }
    bool homogeneous() const { return field.homogeneous(); }
    /// For unequal scales, uses their geometric mean. A row of A is the gradient of one of the field's coordinates.
    double wavelength() const {
        double scale = 1;
        for (int j = 0; j < M; ++j) scale *= length(A[j]);
        return scale > 0 ? field.wavelength() / std::pow(scale, 1.0 / M) : 0;
    }

  private:
    template <class P>
    Vec<P, M> mapped(Vec<P, N> x) const {
        for (int k = 0; k < N; ++k) x[k] -= P(origin[k]);
        Vec<P, M> y;
        for (int j = 0; j < M; ++j)
            for (int k = 0; k < N; ++k) y[j] = mulAdd(P(A[j][k]), x[k], y[j]);
        return y;
    }
};

} // namespace curlew::detail
