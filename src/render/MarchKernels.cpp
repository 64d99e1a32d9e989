// SPDX-License-Identifier: Apache-2.0
#include "MarchKernel.h"
#include "curlew/math/LaneKernels.h"

namespace curlew {

using namespace detail;

template void runOnLanes<CURLEW_SIMD, MarchKernel, double>(const JetBatch<double, 1>&, const MarchOptions&,
                                                           MarchBatch&);

} // namespace curlew
