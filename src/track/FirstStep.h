// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Flow.h"
#include "curlew/track/Stepper.h"

namespace curlew::detail {

/// A first guess at how long the steps along a flow may be, seconds: from how fast its velocity changes along the way,
/// root mean squares over the domain. Infinite for a flow that is the same everywhere, and in an infinite domain.
template <int N>
double firstStep(const FlowN<N>& flow, Scheme scheme, double accuracy);

} // namespace curlew::detail
