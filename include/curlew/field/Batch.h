// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Jet.h"

namespace curlew {

/// Fields are evaluated on this many positions at a time (an eighth of a VDB leaf): enough to hide a virtual call, few
/// enough that every temporary of a composed field stays in the first-level cache.
inline constexpr int kBatch = 64;

/// Positions in N dimensions, world units, as a structure of arrays.
template <int N>
struct PointBatchN {
    int size = 0;
    alignas(64) std::array<std::array<double, kBatch>, N> c;

    /// The positions from i on, as many as P, a type of doubles, has lanes.
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

    /// The jets from position i on, as many as P, a type of Ts, has lanes.
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
