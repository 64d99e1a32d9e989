// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Flow.h"
#include "curlew/track/Stepper.h"

namespace curlew::detail {

/// Returns a first guess for the step length along a flow, seconds, from its speed and the norm of its velocity's
/// Jacobian, both as root mean squares over the domain. Returns infinity for a uniform flow and for an infinite domain.
template <int N>
double firstStep(const FlowN<N>& flow, Scheme scheme, double accuracy);

} // namespace curlew::detail
