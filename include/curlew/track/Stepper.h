// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Flow.h"

#include <cstdint>
#include <string_view>
#include <type_traits>

namespace curlew {

/// Explicit Runge-Kutta schemes. The orders hold if the velocity is smooth enough.
enum class Scheme {
    euler,           ///< First order (ICN Eq. 9).
    midpoint,        ///< Second order.
    rk4,             ///< The classical fourth-order scheme.
    bogackiShampine, ///< Third order with an embedded second-order solution (Bogacki and Shampine, "A 3(2) pair of
                     ///< Runge-Kutta formulas", 1989).
    dormandPrince,   ///< Fifth order with an embedded fourth-order solution (Dormand and Prince, "A family of embedded
                     ///< Runge-Kutta formulae", 1980).
};
/// In the order of the enumerators. bogackiShampine and dormandPrince estimate their error, for adaptive steps.
inline constexpr std::array<std::string_view, 5> kSchemeNames{"euler", "midpoint", "rk4", "rk23", "rk45"};

/// The Butcher tableau of a scheme. Each row is stored as weights and one factor: a stage is evaluated at
/// from + (row.factor dt) Σ row.weights[j] k_j.
struct Tableau {
    static constexpr int kMaxStages = 7; ///< Including the velocity at the end, which error estimates use.
    struct Row {
        double node = 0;   ///< Time of the stage as a fraction of the step: the sum of its coefficients.
        double factor = 1; ///< Common factor of the weights.
        std::array<double, kMaxStages> weights{};
    };
    int order = 1;
    int stages = 1; ///< Velocity evaluations per step, including the one at its beginning.
    /// Rows 1 … stages - 1 give the stages after the first, row `stages` the end of the step.
    std::array<Row, kMaxStages> rows{};
    /// For an embedded pair: the weights of the difference of the two solutions. The last stage is the velocity at the
    /// end of the step, with which the next step begins (first same as last).
    std::array<double, kMaxStages> error{};
    int errorOrder = 0; ///< Order of that difference in dt; 0 if there is no embedded solution.

    constexpr bool embedded() const { return errorOrder > 0; }
};

/// Returns the tableau of a scheme. It is immutable and lives as long as the program.
const Tableau& tableauOf(Scheme scheme);

/// Returns the number of equal steps, none longer than maxStep except for rounding, that divide a time of either sign,
/// seconds: 0 if the time is 0, else at least 1. Throws ValueError if the number is not finite or above 1e9.
int stepsOf(double time, double maxStep);

/// to = from + (fraction dt) velocity, with a time step for each point.
template <int N>
void move(const PointBatchN<N>& from, const VecBatchN<double, N>& velocity, double fraction,
          const std::array<double, kBatch>& dt, PointBatchN<N>& to);

/// The velocities at the stages of a step.
template <int N>
using StagesN = std::array<VecBatchN<double, N>, Tableau::kMaxStages>;

/// sum = Σ weights_j stages_j for `size` points. Stages of weight 0 are not read.
template <int N>
void combine(int size, const std::array<double, Tableau::kMaxStages>& weights, const StagesN<N>& stages,
             VecBatchN<double, N>& sum);

/// Takes one explicit step of every point from `from` to `to`, each with its own time step dt[i]. stages[0] is the
/// velocity at `from`. `velocity(points, velocities)` evaluates it elsewhere, or `velocity(points, node, velocities)`
/// if it depends on time; `node` is the time as a fraction of the step.
template <int N, class VelocityFunction>
void step(Scheme scheme, const PointBatchN<N>& from, const std::array<double, kBatch>& dt,
          const VelocityFunction& velocity, StagesN<N>& stages, PointBatchN<N>& to) {
    const Tableau& tableau = tableauOf(scheme);
    for (int s = 1; s <= tableau.stages; ++s) {
        const Tableau::Row& row = tableau.rows[static_cast<size_t>(s)];
        VecBatchN<double, N> sum;
        combine<N>(from.size, row.weights, stages, sum);
        move(from, sum, row.factor, dt, to);
        if (s == tableau.stages) return;
        if constexpr (std::is_invocable_v<VelocityFunction, PointBatchN<N>&, double, VecBatchN<double, N>&>)
            velocity(to, row.node, stages[static_cast<size_t>(s)]);
        else
            velocity(to, stages[static_cast<size_t>(s)]);
    }
}

/// Returns the difference of the two solutions after a step of an embedded scheme, divided by the time step; zero for
/// other schemes. `last`: the velocity at the end.
template <int N>
VecBatchN<double, N> estimatedDifference(Scheme scheme, int size, StagesN<N>& stages,
                                         const VecBatchN<double, N>& last) {
    const Tableau& tableau = tableauOf(scheme);
    VecBatchN<double, N> difference;
    if (tableau.embedded()) {
        stages[static_cast<size_t>(tableau.stages)] = last;
        combine<N>(size, tableau.error, stages, difference);
    } else {
        for (int i = 0; i < size; ++i) difference.set(i, {});
    }
    return difference;
}

} // namespace curlew
