#pragma once

#include "curlew/flow/Flow.h"

namespace curlew {

enum class Scheme {
    euler,           ///< First order (ICN Eq. 9).
    midpoint,        ///< Second order.
    rk4,             ///< Classical Runge-Kutta, fourth order where the velocity is smooth enough.
    bogackiShampine, ///< Third order, with an embedded second-order one that tells its error, for steps of adaptive
                     ///< length (Bogacki and Shampine, "A 3(2) pair of Runge-Kutta formulas", 1989).
};

/// to = from + (fraction dt) velocity, for each point with its own time step.
template <int N>
void move(const PointBatchN<N>& from, const VecBatchN<double, N>& velocity, double fraction,
          const std::array<double, kBatch>& dt, PointBatchN<N>& to);

/// sum = Σ weights_k v_k, for `size` points; the sum may be one of them.
template <int N>
void combine(int size, const std::array<double, 4>& weights, const std::array<const VecBatchN<double, N>*, 4>& v,
             VecBatchN<double, N>& sum);

/// The velocities that a step looks at, as many as its scheme has.
template <int N>
struct StagesN {
    VecBatchN<double, N> first, second, third, fourth;
};

/// One explicit step of every point from `from`, each with its own time step dt[i], to `to`. stages.first is the
/// velocity at `from`; `velocity(points, velocities)` gives it elsewhere.
template <int N, class VelocityFunction>
void step(Scheme scheme, const PointBatchN<N>& from, const std::array<double, kBatch>& dt,
          const VelocityFunction& velocity, StagesN<N>& stages, PointBatchN<N>& to) {
    auto& [k1, k2, k3, k4] = stages;
    if (scheme == Scheme::euler) return move(from, k1, 1, dt, to);
    move(from, k1, 0.5, dt, to);
    velocity(to, k2);
    if (scheme == Scheme::midpoint) return move(from, k2, 1, dt, to);
    const bool pair = scheme == Scheme::bogackiShampine;
    move(from, k2, pair ? 0.75 : 0.5, dt, to);
    velocity(to, k3);
    if (pair) {
        combine<N>(from.size, {2, 3, 4, 0}, {&k1, &k2, &k3, &k3}, k4);
        return move(from, k4, 1.0 / 9, dt, to);
    }
    move(from, k3, 1, dt, to);
    velocity(to, k4);
    combine<N>(from.size, {1, 2, 2, 1}, {&k1, &k2, &k3, &k4}, k4);
    move(from, k4, 1.0 / 6, dt, to);
}

/// The length of the difference of both solutions of the embedded pair, world units, after a step of it; `last`: the
/// velocity where it ended.
template <int N>
std::array<double, kBatch> estimatedError(int size, const StagesN<N>& stages, const VecBatchN<double, N>& last,
                                          const std::array<double, kBatch>& dt) {
    VecBatchN<double, N> difference;
    combine<N>(size, {-5.0 / 72, 1.0 / 12, 1.0 / 9, -1.0 / 8}, {&stages.first, &stages.second, &stages.third, &last},
               difference);
    std::array<double, kBatch> error;
    for (int i = 0; i < size; ++i)
        error[static_cast<size_t>(i)] = std::abs(dt[static_cast<size_t>(i)]) * length(difference[i]);
    return error;
}

} // namespace curlew
