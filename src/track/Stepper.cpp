// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/Stepper.h"

#include "TrackKernels.h"
#include "curlew/base/Error.h"
#include "curlew/field/Dimensions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace curlew {

namespace {

// Weights are integers over a common denominator where they fit, so each row is rounded once.

constexpr Tableau kEuler{.order = 1, .stages = 1, .rows = {{{}, {.node = 1, .weights = {1}}}}};

constexpr Tableau kMidpoint{.order = 2, .stages = 2, .rows = {{{}, {0.5, 0.5, {1}}, {.node = 1, .weights = {0, 1}}}}};

constexpr Tableau kRk4{
    .order = 4,
    .stages = 4,
    .rows = {{{}, {0.5, 0.5, {1}}, {0.5, 0.5, {0, 1}}, {1, 1, {0, 0, 1}}, {1, 1.0 / 6, {1, 2, 2, 1}}}}};

constexpr Tableau kBogackiShampine{.order = 3,
                                   .stages = 3,
                                   .rows = {{{}, {0.5, 0.5, {1}}, {0.75, 0.75, {0, 1}}, {1, 1.0 / 9, {2, 3, 4}}}},
                                   .error = {-5.0 / 72, 1.0 / 12, 1.0 / 9, -1.0 / 8},
                                   .errorOrder = 3};

constexpr Tableau kDormandPrince{
    .order = 5,
    .stages = 6,
    .rows = {{{},
              {0.2, 0.2, {1}},
              {0.3, 1.0 / 40, {3, 9}},
              {0.8, 1.0 / 45, {44, -168, 160}},
              {8.0 / 9, 1.0 / 6561, {19372, -76080, 64448, -1908}},
              {1, 1.0 / 167904, {477901, -1806240, 1495424, 46746, -45927}},
              {1, 1.0 / 142464, {12985, 0, 64000, 92750, -45927, 18656}}}},
    .error = {71.0 / 57600, 0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525, -1.0 / 40},
    .errorOrder = 5};

} // namespace

const Tableau& tableauOf(Scheme scheme) {
    static constexpr std::array<const Tableau*, kSchemeNames.size()> kTableaus{&kEuler, &kMidpoint, &kRk4,
                                                                               &kBogackiShampine, &kDormandPrince};
    return *kTableaus[static_cast<size_t>(scheme)];
}

int stepsOf(double time, double maxStep) {
    const double steps = std::ceil(std::abs(time) / maxStep - 1e-9);
    if (!(steps <= 1e9)) // also true for NaN
        throw ValueError(
            fmt::format("{} s in steps of {} s takes {:.3g} steps; give a finite time and at most 1e9 steps", time,
                        maxStep, steps));
    return static_cast<int>(std::max(steps, time == 0 ? 0.0 : 1.0));
}

template <int N>
void move(const PointBatchN<N>& from, const VecBatchN<double, N>& velocity, double fraction,
          const std::array<double, kBatch>& dt, PointBatchN<N>& to) {
    runKernel<MoveKernel<N>, double>(from, velocity, std::as_const(fraction), dt, to);
}

template <int N>
void combine(int size, const std::array<double, Tableau::kMaxStages>& weights, const StagesN<N>& stages,
             VecBatchN<double, N>& sum) {
    runKernel<CombineKernel<N>, double>(std::as_const(size), weights, stages, sum);
}

#define CURLEW_INSTANTIATE(N)                                                                                         \
    template void move(const PointBatchN<N>&, const VecBatchN<double, N>&, double, const std::array<double, kBatch>&, \
                       PointBatchN<N>&);                                                                              \
    template void combine(int, const std::array<double, Tableau::kMaxStages>&, const StagesN<N>&,                     \
                          VecBatchN<double, N>&);
CURLEW_FOR_FLOW_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
