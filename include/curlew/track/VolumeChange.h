#pragma once

#include "curlew/track/Advect.h"

namespace curlew {

/// How volumes change along the flow: det(∂x(t)/∂x(0)) of the map that advect() makes, which is 1 in a divergence-free
/// flow. By central differences of step h, so off by O(h²) where the flow is smooth.
struct VolumeChange {
    size_t samples = 0; ///< Positions all of whose neighbours came through; the others are left out.
    double median = 1, lower = 1, upper = 1; ///< Of the determinants; lower and upper: 5 % and 95 % of them.
};

/// At the given positions, which have to be where the flow is, for h world units; 0: 1e-4 of the box's longest edge.
/// Takes six times as long as advecting the positions.
VolumeChange volumeChange(const FlowInTime& flow, const std::vector<Vec3d>& positions, double begin,
                          AdvectOptions options, double h = 0, const Monitor& monitor = {});

} // namespace curlew
