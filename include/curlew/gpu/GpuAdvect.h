// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/gpu/GpuFlow.h"
#include "curlew/track/Advect.h"

namespace curlew {

/// Returns why a GPU cannot move points along the flow with these options; empty if it can.
std::string whyNotOnGpu(const Flow& flow, const AdvectOptions& options);

/// Does on a GPU what advect() does on the processor (track/Advect.h): the same steps, with their errors estimated in
/// the same way, the same conditions for a step at the wall, and the same counts. Positions are floats on the way, so
/// points are at other places along their tracks, by about 1e-6 of the box after 100 steps. The labels of the tracks
/// are computed on the processor, in double, and at the end it moves the points back onto their tracks by at most 1e-4
/// of the diagonal of the box, so that they are as exact as there. The result differs between GPUs by rounding errors.
/// AdvectResult::drift is 0: it is not measured.
///
/// Throws as GpuFlowN does, and ValueError if whyNotOnGpu() is not empty, or as advect() does.
AdvectResult advectOnGpu(const std::shared_ptr<Gpu>& gpu, const Flow& flow, Points& particles,
                         const AdvectOptions& options, const Monitor& monitor = {});

} // namespace curlew
