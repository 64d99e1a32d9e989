#pragma once

#include "curlew/flow/Flow.h"

namespace curlew {

enum class Scheme {
    euler,    ///< First order (ICN Eq. 9).
    midpoint, ///< Second order.
    rk4,      ///< Classical Runge-Kutta, fourth order where the velocity is smooth enough.
};

/// One explicit step of every point from `from`, each with its own time step dt[i], to `to`. `first` is the velocity at
/// `from`; `velocity(points, velocities)` gives it elsewhere.
template <int N, class VelocityFunction>
void step(Scheme scheme, const PointBatchN<N>& from, const VecBatchN<double, N>& first,
          const std::array<double, kBatch>& dt, const VelocityFunction& velocity, PointBatchN<N>& to) {
    to.size = from.size;
    const auto move = [&](const VecBatchN<double, N>& v, double fraction) {
        for (int i = 0; i < from.size; ++i) to.set(i, from[i] + v[i] * (fraction * dt[static_cast<size_t>(i)]));
    };
    VecBatchN<double, N> k2, k3, k4;
    switch (scheme) {
        case Scheme::euler:
            return move(first, 1);
        case Scheme::midpoint:
            move(first, 0.5);
            velocity(to, k2);
            return move(k2, 1);
        case Scheme::rk4:
            break;
    }
    move(first, 0.5);
    velocity(to, k2);
    move(k2, 0.5);
    velocity(to, k3);
    move(k3, 1);
    velocity(to, k4);
    for (int i = 0; i < from.size; ++i) k4.set(i, first[i] + (k2[i] + k3[i]) * 2.0 + k4[i]);
    move(k4, 1.0 / 6);
}

} // namespace curlew
