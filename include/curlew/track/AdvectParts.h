// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Advect.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace curlew {

// Parts of advect(), for others that move points in the same way.

/// Returns the options with the scheme that advect() uses and, for adaptive steps, the accuracy. Throws ValueError as
/// advect() does.
template <int N>
AdvectOptions chosenSteps(const FlowN<N>& flow, const AdvectOptions& options);

/// Returns a first guess for the step length along a flow, seconds, from its speed and the norm of its velocity's
/// Jacobian, both as root mean squares over the domain. Returns infinity for a uniform flow and for an infinite domain.
template <int N>
double firstStep(const FlowN<N>& flow, Scheme scheme, double accuracy);

/// Returns the fraction of the time for which a particle of this age moves (AdvectOptions::byAge).
inline double paceOf(float age, double time) {
    constexpr double kRounding = 1e-6; // of ages, which are floats: one that is as old as the time is not younger
    const double whole = std::abs(time), lived = static_cast<double>(age);
    return lived < whole * (1 - kRounding) ? std::max(lived, 0.0) / whole : 1; // NaN moves for all of it
}

/// Returns the order in which to move particles, those that are close together one after another; empty: in their own
/// order. It only affects the time, because no particle influences another.
std::vector<uint32_t> advectionOrder(const Flow& flow, const Points& particles);

} // namespace curlew
