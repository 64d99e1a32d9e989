#include "CrossKernel.h"
#include "curlew/math/LaneKernels.h"

namespace curlew {

#define CURLEW_INSTANTIATE(T)                                                                               \
    template void runOnLanes<CURLEW_SIMD, CrossKernel<3>, T>(const Flow::Jets<T>&, const int&, const bool&, \
                                                             VecBatch<T>&);
CURLEW_INSTANTIATE(float)
CURLEW_INSTANTIATE(double)
#undef CURLEW_INSTANTIATE

} // namespace curlew
