#pragma once

#include "curlew/math/Jet.h"

namespace curlew {

/// Fields are evaluated on this many positions at a time (an eighth of a VDB leaf): enough to hide a virtual call, few
/// enough that every temporary of a composed field stays in the first-level cache.
inline constexpr int kBatch = 64;

/// Positions, world units, as a structure of arrays.
struct PointBatch {
    int size = 0;
    alignas(64) std::array<std::array<double, kBatch>, 3> c;

    Vec3d operator[](int i) const {
        const auto k = static_cast<size_t>(i);
        return {{c[0][k], c[1][k], c[2][k]}};
    }
    void set(int i, const Vec3d& p) {
        for (size_t axis = 0; axis < 3; ++axis) c[axis][static_cast<size_t>(i)] = p[static_cast<int>(axis)];
    }
    void push(const Vec3d& p) { set(size++, p); }
    bool full() const { return size == kBatch; }
};

/// One jet per position, as a structure of arrays in the order of Jet::component.
template <class T, int Order>
struct JetBatch {
    using JetType = Jet<T, 3, Order>;
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

} // namespace curlew
