#pragma once

#include "curlew/flow/Flow.h"

namespace curlew {

enum class Scheme {
    euler,    ///< First order (ICN Eq. 9).
    midpoint, ///< Second order.
    rk4,      ///< Classical Runge-Kutta, fourth order where the velocity is smooth enough.
};

/// to = from + (fraction dt) velocity, for each point with its own time step.
template <int N>
void move(const PointBatchN<N>& from, const VecBatchN<double, N>& velocity, double fraction,
          const std::array<double, kBatch>& dt, PointBatchN<N>& to);

/// fourth = first + 2 (second + third) + fourth, for `size` points: six times what RK4 moves along.
template <int N>
void weigh(int size, const VecBatchN<double, N>& first, const VecBatchN<double, N>& second,
           const VecBatchN<double, N>& third, VecBatchN<double, N>& fourth);

/// One explicit step of every point from `from`, each with its own time step dt[i], to `to`. `first` is the velocity at
/// `from`; `velocity(points, velocities)` gives it elsewhere.
template <int N, class VelocityFunction>
void step(Scheme scheme, const PointBatchN<N>& from, const VecBatchN<double, N>& first,
          const std::array<double, kBatch>& dt, const VelocityFunction& velocity, PointBatchN<N>& to) {
    VecBatchN<double, N> k2, k3, k4;
    switch (scheme) {
        case Scheme::euler:
            return move(from, first, 1, dt, to);
        case Scheme::midpoint:
            move(from, first, 0.5, dt, to);
            velocity(to, k2);
            return move(from, k2, 1, dt, to);
        case Scheme::rk4:
            break;
    }
    move(from, first, 0.5, dt, to);
    velocity(to, k2);
    move(from, k2, 0.5, dt, to);
    velocity(to, k3);
    move(from, k3, 1, dt, to);
    velocity(to, k4);
    weigh(from.size, first, k2, k3, k4);
    move(from, k4, 1.0 / 6, dt, to);
}

} // namespace curlew
