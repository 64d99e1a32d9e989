// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Advect.h"

namespace curlew {

/// How volumes change along the flow: the determinant of the derivative of its map, det(∂x(t)/∂x(0)), which is 1 in a
/// divergence-free flow.
struct VolumeChange {
    size_t samples = 0;                      ///< Positions that the flow moves; those beyond its wall are left out.
    double median = 1, lower = 1, upper = 1; ///< Of the determinants; lower and upper: 5 % and 95 % of them.
    double farthest = 0;                     ///< The largest |determinant - 1|.
};

/// At the given positions. The variational equation dM/dt = (∂c/∂x) M is integrated beside each position, with the
/// Hessians of the potentials, by steps of rk45 that are so short that neither the place nor the determinant is off by
/// more than about 1e-9 a step, relative to the size of the domain: whatever the steps of `options` are, of which only
/// the time counts, and in a flow that changes the number of moments at which it is frozen. What a moving wall does is
/// measured by central differences. Throws what advect() throws for these options.
VolumeChange volumeChange(const FlowInTime& flow, const std::vector<Vec3d>& positions, double begin,
                          const AdvectOptions& options, const Monitor& monitor = {});

} // namespace curlew
