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

    Vec<double, N> operator[](int i) const {
        Vec<double, N> p;
        for (int axis = 0; axis < N; ++axis) p[axis] = c[static_cast<size_t>(axis)][static_cast<size_t>(i)];
        return p;
    }
    void set(int i, const Vec<double, N>& p) {
        for (int axis = 0; axis < N; ++axis) c[static_cast<size_t>(axis)][static_cast<size_t>(i)] = p[axis];
    }
    void push(const Vec<double, N>& p) { set(size++, p); }
    bool full() const { return size == kBatch; }
};
using PointBatch = PointBatchN<3>;

/// One jet per position, as a structure of arrays in the order of Jet::component.
template <class T, int N, int Order>
struct JetBatchN {
    using JetType = Jet<T, N, Order>;
    alignas(64) std::array<std::array<T, kBatch>, JetType::kSize> c;

    JetType operator[](int i) const {
        JetType jet;
        for (int k = 0; k < JetType::kSize; ++k) jet.component(k) = c[static_cast<size_t>(k)][static_cast<size_t>(i)];
        return jet;
    }
    void set(int i, const JetType& jet) {
        for (int k = 0; k < JetType::kSize; ++k) c[static_cast<size_t>(k)][static_cast<size_t>(i)] = jet.component(k);
    }
};
template <class T, int Order>
using JetBatch = JetBatchN<T, 3, Order>;

} // namespace curlew
