// SPDX-License-Identifier: Apache-2.0
#include "TriangleDistances.h"
#include "curlew/math/LaneKernels.h"

namespace curlew {

template void runOnLanes<CURLEW_SIMD, TriangleKernel, double>(const Triangles&, TriangleKernel::Result&);
template void runOnLanes<CURLEW_SIMD, TriangleFromKernel, double>(const PreparedTriangle<double>&, const PointBatch&,
                                                                  std::array<double, kBatch>&);
template void runOnLanes<CURLEW_SIMD, LeafTriangleKernel, double>(const std::span<const LeafTriangle>&,
                                                                  LeafTriangleKernel::Closest&);

} // namespace curlew
