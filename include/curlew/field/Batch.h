// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Jet.h"

namespace curlew {

/// The number of positions at which fields are evaluated at a time (an eighth of a VDB leaf). It is large enough to
/// hide a virtual call, and small enough to keep every temporary of a composed field in the L1 cache.
inline constexpr int kBatch = 64;

/// Positions in N dimensions in world units, as a structure of arrays.
template <int N>
struct PointBatchN {
    int size = 0;
    alignas(64) std::array<std::array<double, kBatch>, N> c;

    /// Returns the positions from i on, as many as P has lanes. P is double or lanes of double.
    template <class P>
    Vec<P, N> lanes(int i) const {
        Vec<P, N> p;
        for (int axis = 0; axis < N; ++axis) p[axis] = load<P>(&c[static_cast<size_t>(axis)][static_cast<size_t>(i)]);
        return p;
    }
    template <class P = double>
    void set(int i, const Vec<P, N>& p) {
        for (int axis = 0; axis < N; ++axis) store(p[axis], &c[static_cast<size_t>(axis)][static_cast<size_t>(i)]);
    }
    Vec<double, N> operator[](int i) const { return lanes<double>(i); }
    void push(const Vec<double, N>& p) { set(size++, p); }
    bool full() const { return size == kBatch; }
};
using PointBatch = PointBatchN<3>;

/// One jet per position, as a structure of arrays in the order of Jet::component.
template <class T, int N, int Order>
struct JetBatchN {
    using JetType = Jet<T, N, Order>;
    alignas(64) std::array<std::array<T, kBatch>, JetType::kSize> c;

    /// Returns the jets from position i on, as many as P has lanes. P is T or lanes of T.
    template <class P>
    Jet<P, N, Order> lanes(int i) const {
        Jet<P, N, Order> jet;
        for (int k = 0; k < jet.kSize; ++k)
            jet.component(k) = load<P>(&c[static_cast<size_t>(k)][static_cast<size_t>(i)]);
        return jet;
    }
    template <class P = T>
    void set(int i, const Jet<P, N, Order>& jet) {
        for (int k = 0; k < jet.kSize; ++k) store(jet.component(k), &c[static_cast<size_t>(k)][static_cast<size_t>(i)]);
    }
    JetType operator[](int i) const { return lanes<T>(i); }
};
template <class T, int Order>
using JetBatch = JetBatchN<T, 3, Order>;

} // namespace curlew
