// SPDX-License-Identifier: Apache-2.0
#include "CrossKernel.h"
#include "curlew/field/Dimensions.h"
#include "curlew/math/LaneKernels.h"

namespace curlew {

#define CURLEW_INSTANTIATE(N, T)                                                                                \
    template void runOnLanes<CURLEW_SIMD, CrossKernel<N>, T>(const FlowN<N>::Jets<T>&, const int&, const bool&, \
                                                             VecBatchN<T, N>&);
#define CURLEW_INSTANTIATE_BOTH(N) CURLEW_INSTANTIATE(N, float) CURLEW_INSTANTIATE(N, double)
CURLEW_FOR_FLOW_DIMENSIONS(CURLEW_INSTANTIATE_BOTH)
#undef CURLEW_INSTANTIATE_BOTH
#undef CURLEW_INSTANTIATE

} // namespace curlew
