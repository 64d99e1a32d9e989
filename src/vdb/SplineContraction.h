// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "LeafTable.h"
#include "curlew/field/Batch.h"
#include "curlew/math/CubicBSpline.h"

namespace curlew {

/// Evaluation of a tricubic B-spline from coefficients that have already been located; independent of OpenVDB.
struct SplineContraction {
    static constexpr int kLeaf = 8, kBlock = kLeaf + 3; ///< Edge lengths of a leaf, and of the block of coefficients
                                                        ///< that it needs.

    /// For each position of a batch: the first of its 4³ coefficients in a block of kBlock³ (z fastest), and its
    /// position between the second and the third coefficient, within [0, 1).
    struct Places {
        int size = 0;
        std::array<const float*, kBatch> corner;
        PointBatch fraction;
    };
};

/// Where the positions of a batch are in a grid. All but `fraction` are integers.
struct SplinePlaces {
    PointBatch leaf; ///< Coordinates of the leaf: its origin / 8.
    PointBatch fraction;
    alignas(64) std::array<double, kBatch> column, layer, slot, place; ///< LeafTable::Key.
    alignas(64) std::array<double, kBatch> inBlock; ///< Of the first of the 4³ coefficients in the block of the leaf.

    LeafTable::Key<double> key(size_t i) const { return {column[i], layer[i], slot[i], place[i]}; }
};

/// Computes the voxel whose centre is next below each position, and the position relative to it. Coordinates that no
/// voxel can have, and NaN, become kNowhere. `slots`: of the LeafTable.
struct PlaceKernel {
    static constexpr double kNowhere = 0x1p30;

    template <class T>
    static void run(const PointBatch& points, const Matrix3& toIndex, const Vec3d& shift, const double& slots,
                    SplinePlaces& places) {
        constexpr double kLeaf = SplineContraction::kLeaf, kBlock = SplineContraction::kBlock;
        for (int i = 0; i < points.size; i += kLanes<T>) {
            const auto n = static_cast<size_t>(i);
            const Vec3<T> p = points.template lanes<T>(i);
            Vec3<T> leaf, within, rest;
            for (int axis = 0; axis < 3; ++axis) {
                T x(shift[axis]);
                for (int k = 0; k < 3; ++k) x = mulAdd(T(toIndex[axis][k]), p[k], x);
                const auto near = abs(x) < T(kNowhere);
                const T voxel = select(near, floor(x), T(kNowhere));
                rest[axis] = select(near, x - voxel, T(0));
                leaf[axis] = floor(voxel * T(1 / kLeaf));
                within[axis] = mulAdd(leaf[axis], T(-kLeaf), voxel);
            }
            const auto key = LeafTable::keyOf<T>(leaf, slots);
            places.leaf.set(i, leaf);
            places.fraction.set(i, rest);
            store(key.column, &places.column[n]);
            store(key.layer, &places.layer[n]);
            store(key.slot, &places.slot[n]);
            store(key.place, &places.place[n]);
            store(mulAdd(mulAdd(within[0], T(kBlock), within[1]), T(kBlock), within[2]), &places.inBlock[n]);
        }
    }
};

/// Weights of a tensor-product spline: [axis][derivative][coefficient].
template <class T, int Order>
using SplineWeights = std::array<std::array<std::array<T, 4>, size_t{Order + 1}>, 3>;

/// Returns the weights at t between the second and the third coefficient along each axis.
template <int Order, class T>
SplineWeights<T, Order> splineWeights(const Vec<Rebind<T, double>, 3>& t) {
    SplineWeights<T, Order> w;
    for (int axis = 0; axis < 3; ++axis)
        for (int d = 0; d <= Order; ++d)
            w[static_cast<size_t>(axis)][static_cast<size_t>(d)] = cubicBSplineWeights(convertTo<T>(t[axis]), d);
    return w;
}

/// Sums 64 coefficients along z, then y, then x, with the weights of all derivatives up to the order. `row(i, j)`
/// returns the four coefficients along z.
template <int Order, class T, class Row>
Jet<T, 3, Order> contractedSpline(const SplineWeights<T, Order>& w, const Row& row) {
    constexpr size_t kD = Order + 1;
    std::array<std::array<std::array<T, kD>, kD>, kD> sum{}; // [d/dx][d/dy][d/dz]
    for (size_t i = 0; i < 4; ++i) {
        std::array<std::array<T, kD>, kD> plane{};
        for (size_t j = 0; j < 4; ++j) {
            const std::array<T, 4> c = row(i, j);
            for (size_t dz = 0; dz <= Order; ++dz) {
                T line = c[0] * w[2][dz][0];
                for (size_t k = 1; k < 4; ++k) line = mulAdd(c[k], w[2][dz][k], line);
                for (size_t dy = 0; dy + dz <= Order; ++dy) plane[dy][dz] = mulAdd(line, w[1][dy][j], plane[dy][dz]);
            }
        }
        for (size_t dx = 0; dx <= Order; ++dx)
            for (size_t dy = 0; dx + dy <= Order; ++dy)
                for (size_t dz = 0; dx + dy + dz <= Order; ++dz)
                    sum[dx][dy][dz] = mulAdd(plane[dy][dz], w[0][dx][i], sum[dx][dy][dz]);
    }
    Jet<T, 3, Order> jet(sum[0][0][0]);
    if constexpr (Order >= 1) jet.gradient = {{sum[1][0][0], sum[0][1][0], sum[0][0][1]}};
    if constexpr (Order >= 2)
        jet.hessian.c = {sum[2][0][0], sum[0][2][0], sum[0][0][2], sum[1][1][0], sum[1][0][1], sum[0][1][1]};
    if constexpr (Order >= 3)
        jet.forTriples([&](int i, int j, int k) {
            std::array<size_t, 3> d{};
            for (const int axis : {i, j, k}) ++d[static_cast<size_t>(axis)];
            jet.third(i, j, k) = sum[d[0]][d[1]][d[2]];
        });
    return jet;
}

/// Computes jets of the spline, which is given in the coordinates A x + b.
template <int Order>
struct SplineKernel {
    template <class T>
    static void run(const SplineContraction::Places& places, const Matrix3& A, JetBatch<NumberOf<T>, Order>& jets) {
        for (int i = 0; i < places.size; i += kLanes<T>) {
            const auto w = splineWeights<Order, T>(places.fraction.template lanes<Rebind<T, double>>(i));
            constexpr size_t kEdge = SplineContraction::kBlock;
            const float* const* corners = &places.corner[static_cast<size_t>(i)];
            const auto jet = contractedSpline<Order>(
                w, [&](size_t x, size_t y) { return fourFrom<T>(corners, (x * kEdge + y) * kEdge); });
            jets.set(i, pullBack(jet, A));
        }
    }
};

} // namespace curlew
