// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/gpu/Gpu.h"
#include "curlew/picture/Lic.h"
#include "curlew/picture/Warp.h"

namespace curlew {

// Parts of pictures on a GPU, in float. They throw GpuError if it fails, and ResourceError if its memory does not
// suffice.

/// Returns what moves positions as warp() does (picture/Warp.h). It also throws as GpuFlowN does.
Warper warperOn(std::shared_ptr<Gpu> gpu);

/// Returns what averages noise as convolved() does (picture/Lic.h).
LicConvolution convolutionOn(std::shared_ptr<Gpu> gpu);

} // namespace curlew
