// SPDX-License-Identifier: Apache-2.0
#include "SplineContraction.h"
#include "SplineLattice.h"
#include "curlew/math/LaneKernels.h"

namespace curlew {

template void runOnLanes<CURLEW_SIMD, PlaceKernel, double>(const PointBatch&, const Matrix3&, const Vec3d&,
                                                           const double&, SplinePlaces&);

#define CURLEW_INSTANTIATE(T, Order)                                                                                \
    template void runOnLanes<CURLEW_SIMD, SplineKernel<Order>, T>(const SplineContraction::Places&, const Matrix3&, \
                                                                  JetBatch<T, Order>&);
CURLEW_INSTANTIATE(float, 0)
CURLEW_INSTANTIATE(float, 1)
CURLEW_INSTANTIATE(double, 0)
CURLEW_INSTANTIATE(double, 1)
CURLEW_INSTANTIATE(double, 2)
#undef CURLEW_INSTANTIATE

#define CURLEW_INSTANTIATE(T, Order)                                      \
    template void runOnLanes<CURLEW_SIMD, SplineLatticeKernel<Order>, T>( \
        const size_t&, const size_t&, const SplineLattice&, const Matrix3&, LatticeJets<T, Order>&);
CURLEW_INSTANTIATE(float, 1)
CURLEW_INSTANTIATE(double, 0)
#undef CURLEW_INSTANTIATE

} // namespace curlew
