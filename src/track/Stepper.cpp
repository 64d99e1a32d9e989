#include "curlew/track/Stepper.h"

#include "TrackKernels.h"
#include "curlew/field/Dimensions.h"

namespace curlew {

template <int N>
void move(const PointBatchN<N>& from, const VecBatchN<double, N>& velocity, double fraction,
          const std::array<double, kBatch>& dt, PointBatchN<N>& to) {
    runTrackKernel<N, MoveKernel<N>>(from, velocity, std::as_const(fraction), dt, to);
}

template <int N>
void weigh(int size, const VecBatchN<double, N>& first, const VecBatchN<double, N>& second,
           const VecBatchN<double, N>& third, VecBatchN<double, N>& fourth) {
    runTrackKernel<N, WeighKernel<N>>(std::as_const(size), first, second, third, fourth);
}

#define CURLEW_INSTANTIATE(N)                                                                                         \
    template void move(const PointBatchN<N>&, const VecBatchN<double, N>&, double, const std::array<double, kBatch>&, \
                       PointBatchN<N>&);                                                                              \
    template void weigh(int, const VecBatchN<double, N>&, const VecBatchN<double, N>&, const VecBatchN<double, N>&,   \
                        VecBatchN<double, N>&);
CURLEW_FOR_FLOW_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
