#include "CrossKernel.h"
#include "curlew/math/LaneKernels.h"

namespace curlew {

#define CURLEW_INSTANTIATE(N, T)                                                                                \
    template void runOnLanes<CURLEW_SIMD, CrossKernel<N>, T>(const FlowN<N>::Jets<T>&, const int&, const bool&, \
                                                             VecBatchN<T, N>&);
CURLEW_INSTANTIATE(2, float)
CURLEW_INSTANTIATE(2, double)
CURLEW_INSTANTIATE(3, float)
CURLEW_INSTANTIATE(3, double)
#undef CURLEW_INSTANTIATE

} // namespace curlew
