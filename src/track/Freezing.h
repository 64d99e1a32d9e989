// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "AdvectSteps.h"
#include "curlew/flow/FlowInTime.h"

namespace curlew::detail {

/// How often a flow that changes is frozen on the way, and what that costs.
struct Freezing {
    int moments = 1;
    double error = 0; ///< Estimated, of the place at the end, world units: the mean. 0 where it is not known.
};

/// As often as `options` say, if their steps are equal; else at least so often (without steps: kMoments), and so often
/// that the error of a frozen step is within the accuracy for 95 % of 256 pseudo-random points of the domain (the same
/// at every call). It is estimated at the beginning: by one frozen step and two of half its length, whose errors, of
/// third order, differ by 3/4 of the former. `options` with an accuracy, unless their steps are equal; `before`: the
/// flow at the beginning. At most 64 times as often as said: what is beyond that shows in the error.
Freezing freezingOf(const FlowInTime& flow, const Flow& before, double begin, const AdvectOptions& options,
                    const AdvectScales& scales, const Monitor& monitor);

} // namespace curlew::detail
