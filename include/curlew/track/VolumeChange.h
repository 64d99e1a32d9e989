// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Advect.h"

namespace curlew {

/// Change of volumes along the flow: the determinant of the flow map's Jacobian, det(∂x(t)/∂x(0)), which is 1 in a
/// divergence-free flow.
struct VolumeChange {
    size_t samples = 0;                      ///< Positions that the flow moves; those beyond its wall are excluded.
    double median = 1, lower = 1, upper = 1; ///< Percentiles of the determinants: 50 %, 5 % and 95 %.
    double farthest = 0;                     ///< Maximum of |determinant - 1|.
};

/// Measures the volume change at the given positions. The variational equation dM/dt = (∂c/∂x) M is integrated together
/// with each position, using the Hessians of the potentials. The rk45 steps are short enough that the errors of the
/// position, relative to the size of the domain, and of the determinant are below about 1e-9 per step. Of `options`
/// only the time counts, and in a time-dependent flow the number of times at which it is frozen. The effect of a moving
/// wall is measured by central differences. Throws ValueError if a time is not finite, or if the box of the flow's
/// domain is infinite or a point; Interrupted on cancellation.
VolumeChange volumeChange(const FlowInTime& flow, const std::vector<Vec3d>& positions, double begin,
                          const AdvectOptions& options, const Monitor& monitor = {});

} // namespace curlew
