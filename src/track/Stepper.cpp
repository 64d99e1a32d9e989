#include "curlew/track/Stepper.h"

#include "TrackKernels.h"
#include "curlew/field/Dimensions.h"

namespace curlew {

template <int N>
void move(const PointBatchN<N>& from, const VecBatchN<double, N>& velocity, double fraction,
          const std::array<double, kBatch>& dt, PointBatchN<N>& to) {
    runKernel<MoveKernel<N>, double>(from, velocity, std::as_const(fraction), dt, to);
}

template <int N>
void combine(int size, const std::array<double, 4>& weights, const std::array<const VecBatchN<double, N>*, 4>& v,
             VecBatchN<double, N>& sum) {
    runKernel<CombineKernel<N>, double>(std::as_const(size), weights, v, sum);
}

#define CURLEW_INSTANTIATE(N)                                                                                         \
    template void move(const PointBatchN<N>&, const VecBatchN<double, N>&, double, const std::array<double, kBatch>&, \
                       PointBatchN<N>&);                                                                              \
    template void combine(int, const std::array<double, 4>&, const std::array<const VecBatchN<double, N>*, 4>&,       \
                          VecBatchN<double, N>&);
CURLEW_FOR_FLOW_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
