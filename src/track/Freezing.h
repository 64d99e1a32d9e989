// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "AdvectSteps.h"
#include "curlew/flow/FlowInTime.h"

namespace curlew::detail {

/// How often a time-dependent flow is frozen, and the error that this causes.
struct Freezing {
    int moments = 1;
    double error = 0; ///< Estimated mean position error at the end, world units; 0: unknown.
};

/// Chooses how often to freeze a flow. For equal steps: as often as `options` say. For adaptive steps: at least
/// `options.steps` times (0: kMoments), and often enough that the error of a frozen step is within the accuracy for 95
/// % of 256 pseudo-random points of the domain (the same at every call), but at most 64 times that minimum; any further
/// error shows in Freezing::error. The error is estimated at the beginning, from one frozen step and two of half its
/// length: their errors are third order, so their difference is 3/4 of that of the whole step. `options` must have an
/// accuracy unless its steps are equal; `before`: the flow at the beginning.
Freezing freezingOf(const FlowInTime& flow, const Flow& before, double begin, const AdvectOptions& options,
                    const FlowRms& rms, const Monitor& monitor);

} // namespace curlew::detail
