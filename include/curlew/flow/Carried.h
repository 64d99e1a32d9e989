// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Flow.h"

namespace curlew {

struct CarryOptions {
    double time = 0.1; ///< Seconds, of either sign; above 0: along the flow.
    int steps = 4;     ///< Of RK4, by which the flow map is followed.
};

/// The field as a flow carries it along for a short time: field(X(x, -t)), X the flow map (DeWolf §5, "advecting the
/// scalar fields by the vector fields"). Of octaves carried by the flow of those before them, the small swirls go where
/// the large ones take them, and are drawn out between them; the longer, the more, and the finer: keep the time below a
/// turn of the large ones.
///
/// Derivatives are exact: jets go through every Runge-Kutta stage, so they are those of the discrete map. A flow of
/// carried potentials is therefore divergence-free whatever the number of steps; steps only tell how well the map is
/// that of the flow. Each derivative needs those of the flow's potentials to one order more: the field is C² where they
/// are C³ (Psrd2, SimplexNoise of power 4, SineNoise); for the others its Hessian jumps where their third derivatives
/// do. It has no third derivatives of its own, so it can neither displace nor carry another (ValueError).
///
/// Costs 4 `steps` evaluations of the flow's potentials with derivatives of one order more. N = 2, 3. Throws ValueError
/// for a normalised flow, for a time that is not finite, fewer than 1 or more than 1000 steps, and potentials without
/// third derivatives. Immutable, safe to share between threads.
template <int N>
ScalarFieldN<N> carried(const ScalarFieldN<N>& field, const FlowN<N>& flow, const CarryOptions& options = {});

} // namespace curlew
