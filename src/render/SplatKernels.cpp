// SPDX-License-Identifier: Apache-2.0
#include "LightKernel.h"
#include "curlew/math/LaneKernels.h"

namespace curlew {

using namespace detail;

template void runOnLanes<CURLEW_SIMD, LightKernel, float>(const std::vector<LightStroke>&, const bool&, LitTile&);

} // namespace curlew
