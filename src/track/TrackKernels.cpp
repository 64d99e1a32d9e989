// SPDX-License-Identifier: Apache-2.0
#include "TrackKernels.h"

#include "curlew/field/Dimensions.h"
#include "curlew/math/LaneKernels.h"

namespace curlew {

using Numbers = std::array<double, kBatch>;

#define CURLEW_INSTANTIATE(N)                                                                                          \
    template void runOnLanes<CURLEW_SIMD, MoveKernel<N>, double>(const PointBatchN<N>&, const VecBatchN<double, N>&,   \
                                                                 const double&, const Numbers&, PointBatchN<N>&);      \
    template void runOnLanes<CURLEW_SIMD, CombineKernel<N>, double>(                                                   \
        const int&, const std::array<double, Tableau::kMaxStages>&, const StagesN<N>&, VecBatchN<double, N>&);         \
    template void runOnLanes<CURLEW_SIMD, LengthKernel<N>, double>(const PointBatchN<N>&, const PointBatchN<N>&,       \
                                                                   Numbers&);                                          \
    template void runOnLanes<CURLEW_SIMD, StepErrorKernel<N>, double>(                                                 \
        const int&, const VecBatchN<double, N>&, const Numbers&, const VecBatchN<double, N>&,                          \
        const VecBatchN<double, N>&, const double&, Numbers&);                                                         \
    template void runOnLanes<CURLEW_SIMD, NearTrackKernel<N>, double>(const FlowN<N>::Jets<double>&, const int&,       \
                                                                      const TrackBatchN<N>&, const double&, Numbers&); \
    template void runOnLanes<CURLEW_SIMD, ResidualKernel<N>, double>(                                                  \
        const FlowN<N>::Jets<double>&, const int&, const TrackBatchN<N>&, const ReprojectOptionsN<N>&, Residuals<N>&); \
    template void runOnLanes<CURLEW_SIMD, GaussNewtonKernel<N>, double>(const FlowN<N>::Jets<double>&,                 \
                                                                        const TrackBatchN<N>&, const Numbers&,         \
                                                                        const ReprojectOptionsN<N>&, PointBatchN<N>&); \
    template void runOnLanes<CURLEW_SIMD, NewtonKernel<N>, double>(                                                    \
        const FlowN<N>::Jets<double>&, const size_t&, const size_t&, const Numbers&, const Numbers&, PointBatchN<N>&);
CURLEW_FOR_FLOW_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
