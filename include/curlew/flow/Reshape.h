// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Flow.h"

namespace curlew {

/// How a flow is slowed down, streamline by streamline.
struct ReshapeOptions {
    /// No streamline goes faster than this, world units per second; 0: no limit. Each is slowed as a whole, in
    /// proportion to its fastest place, which is found by sampling the domain and then smoothed to the safe side. It
    /// may be missed where it is small: of noise in the open 1 place in 10^4 is a little faster, in a thin layer along
    /// a wall 1 in 1000, the fastest of them by half.
    double limit = 0;
    /// Only streamlines with f, or g, in the interval move; over `softness` of its length at each end, inside it, they
    /// fade in. At most 1/2. Of an interval with an infinite end the length is that of what occurs in it.
    Range f{}, g{};
    double softness = 0.25;
};

/// h(f, g) c with 0 <= h <= 1 (docs/math.md): the same streamlines at other speeds, exactly divergence-free, since it
/// is the flow of ∫ h df and g. h is a bicubic spline, C², over the values that f and g have in the domain. Throws
/// ValueError for a flow without tracks or normalised, intervals that are empty or leave nothing to move (too narrow
/// for the spline: below a twentieth of those values), and a negative limit.
Flow reshaped(const Flow& flow, const ReshapeOptions& options, const Monitor& monitor = {});

} // namespace curlew
