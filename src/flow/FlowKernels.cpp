#include "CrossKernel.h"
#include "curlew/math/LaneKernels.h"

namespace curlew {

#define CURLEW_INSTANTIATE(N, T)                                                                                \
    template void runOnLanes<CURLEW_SIMD, CrossKernel<N>, T>(const FlowN<N>::Jets<T>&, const int&, const bool&, \
                                                             VecBatchN<T, N>&);
#define CURLEW_INSTANTIATE_BOTH(N) \
    CURLEW_INSTANTIATE(N, float)   \
    CURLEW_INSTANTIATE(N, double)
CURLEW_INSTANTIATE_BOTH(3)
CURLEW_INSTANTIATE_BOTH(4)
CURLEW_INSTANTIATE_BOTH(5)
CURLEW_INSTANTIATE_BOTH(6)
CURLEW_INSTANTIATE_BOTH(7)
#undef CURLEW_INSTANTIATE_BOTH
#undef CURLEW_INSTANTIATE

} // namespace curlew
