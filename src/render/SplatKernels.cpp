// SPDX-License-Identifier: Apache-2.0
#include "LightKernel.h"
#include "ProjectKernel.h"
#include "TileKernel.h"
#include "curlew/math/LaneKernels.h"

namespace curlew {

using namespace detail;

template void runOnLanes<CURLEW_SIMD, ProjectKernel, double>(const Camera&, const ProjectKernel::Job&);
template void runOnLanes<CURLEW_SIMD, TileKernel, float>(const TileKernel::Job&, const SplatLook&, TileKernel::Tiles&);
template void runOnLanes<CURLEW_SIMD, StrokeKernel, float>(const LightEdges&, const SplatLook&, const SplatTile&,
                                                           LightStrokes&);
template void runOnLanes<CURLEW_SIMD, LightKernel, float>(const LightEdges&, const LightStrokes&, const bool&,
                                                          LitTile&);

} // namespace curlew
