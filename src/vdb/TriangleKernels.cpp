// SPDX-License-Identifier: Apache-2.0
#include "TriangleDistances.h"
#include "curlew/math/LaneKernels.h"

namespace curlew {

template void runOnLanes<CURLEW_SIMD, TriangleKernel, double>(const Triangles&, TriangleKernel::Result&);

} // namespace curlew
