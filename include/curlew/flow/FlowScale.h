// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Flow.h"

namespace curlew {

/// Over which length a flow's velocity varies, world units: 2π times the rms deviation of the velocity from its mean
/// over the rms of its gradient, which for a plane wave is its wavelength. Of several octaves it is nearer to that of
/// the finest one, since those have the gradients. A grid wants at least kVoxelsPerWavelength voxels of it. From the
/// same pseudo-random positions in the domain at every call. Returns 0 if the flow is uniform, or if the domain is
/// infinite or empty.
double wavelengthOf(const Flow& flow, const Monitor& monitor = {});

/// With fewer, linear interpolation loses details.
inline constexpr double kVoxelsPerWavelength = 4;

} // namespace curlew
