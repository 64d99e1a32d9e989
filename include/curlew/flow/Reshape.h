// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Flow.h"

namespace curlew {

/// How a flow is slowed down, one streamline at a time.
struct ReshapeOptions {
    /// The maximum speed of every streamline, in world units per second; 0: no limit. Each streamline is slowed as a
    /// whole, in proportion to its maximum speed, which is found by sampling the domain and climbing from the fastest
    /// samples. The result is smoothed conservatively. Small regions of high speed may be missed: in one of four
    /// flows of noise, 1 of 300,000 positions was faster, by 2 %.
    double limit = 0;
    /// Only streamlines with f and g in these intervals move. Inside an interval they fade in over `softness` of its
    /// length at each end; at most 1/2. If an end is infinite, the length is that of the values in the interval that
    /// occur.
    Interval f{}, g{};
    double softness = 0.25;
};

/// Returns h(f, g) c with 0 <= h <= 1 (docs/math.md): the same streamlines at other speeds. It is exactly
/// divergence-free, because it is the flow of ∫ h df and g. h is a bicubic spline, C², over the values of f and g in
/// the domain. Throws ValueError if the flow has no tracks or is normalised, if its domain is infinite or empty, if a
/// potential is constant, if an option is out of range, or if the intervals are empty or leave nothing to move (if they
/// are too narrow for the spline: below a twentieth of those values).
Flow reshaped(const Flow& flow, const ReshapeOptions& options, const Monitor& monitor = {});

} // namespace curlew
