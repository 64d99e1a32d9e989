#include "TrackKernels.h"

#include "curlew/math/LaneKernels.h"

namespace curlew {

using Numbers = std::array<double, kBatch>;

template void runOnLanes<CURLEW_SIMD, MoveKernel<3>, double>(const PointBatch&, const VecBatch<double>&, const double&,
                                                             const Numbers&, PointBatch&);
template void runOnLanes<CURLEW_SIMD, CombineKernel<3>, double>(const int&, const std::array<double, 4>&,
                                                                const std::array<const VecBatch<double>*, 4>&,
                                                                VecBatch<double>&);
template void runOnLanes<CURLEW_SIMD, ResidualKernel<3>, double>(const Flow::Jets<double>&, const int&,
                                                                 const TrackBatch&, const ReprojectOptions&,
                                                                 Residuals<3>&);
template void runOnLanes<CURLEW_SIMD, GaussNewtonKernel<3>, double>(const Flow::Jets<double>&, const TrackBatch&,
                                                                    const Numbers&, const ReprojectOptions&,
                                                                    PointBatch&);
template void runOnLanes<CURLEW_SIMD, NewtonKernel<3>, double>(const JetBatch<double, 1>&, const Numbers&,
                                                               const Numbers&, PointBatch&);

} // namespace curlew
