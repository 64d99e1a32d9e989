// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Flow.h"

namespace curlew {

/// Returns the rms speed of a flow over its domain (rmsOf). Throws ValueError if the flow does not move.
template <int N>
double movingSpeedOf(const FlowN<N>& flow, const Monitor& monitor = {});

/// Returns the length over which a flow's velocity varies, in world units: 2π times the rms deviation of the velocity
/// from its mean, over the rms of the velocity gradient. For a plane wave this is the wavelength. For several octaves
/// it is closer to that of the finest one, which dominates the gradient. A grid should have at least
/// kVoxelsPerWavelength voxels per wavelength. Uses the same positions in the domain at every call.
/// Returns 0 if the flow is uniform, or if the domain is infinite or empty.
double wavelengthOf(const Flow& flow, const Monitor& monitor = {});

/// With fewer voxels, linear interpolation loses details.
inline constexpr double kVoxelsPerWavelength = 4;

} // namespace curlew
