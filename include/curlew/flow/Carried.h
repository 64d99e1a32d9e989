// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Flow.h"

namespace curlew {

struct CarryOptions {
    double time = 0.1; ///< In seconds; positive: along the flow, negative: against it.
    int steps = 4;     ///< Number of RK4 steps that approximate the flow map.
};

/// The field advected by a flow for a short time: field(X(x, -t)), where X is the flow map (DeWolf §5, "advecting the
/// scalar fields by the vector fields"). If each octave is advected by the flow of the octaves before it (advected
/// octaves), the large swirls carry the small ones along and stretch them. More time stretches them more, and into
/// finer detail; keep the time below one turn of the large swirls.
///
/// Derivatives are exact: jets pass through every Runge-Kutta stage, so they are the derivatives of the discrete map. A
/// flow of advected potentials is therefore divergence-free for any number of steps; the number only determines how
/// well the discrete map approximates the flow map. Each derivative needs those of the flow's potentials to one order
/// more. The field is C² if they are C³ (Psrd2, SimplexNoise of power 4, SineNoise); for others, its Hessian jumps
/// where their third derivatives do. It has no third derivatives of its own, so it can neither displace nor advect
/// another field (ValueError).
///
/// Costs 4 `steps` evaluations of the flow's potentials with derivatives of one order more, and one of the field. N =
/// 2,
/// 3. Throws ValueError if the flow is normalised, preserves the area of level sets or has no potentials, if the time
/// is not finite, if `steps` is not in 1 … 1000, or if a potential has no third derivatives. Immutable; safe to share
/// between threads.
template <int N>
ScalarFieldN<N> carried(const ScalarFieldN<N>& field, const FlowN<N>& flow, const CarryOptions& options = {});

} // namespace curlew
