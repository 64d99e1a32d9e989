// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Action.h"
#include "curlew/app/run/Context.h"
#include "curlew/flow/FlowInTime.h"
#include "curlew/picture/Lic.h"
#include "curlew/picture/Warp.h"
#include "curlew/track/Advect.h"
#include "curlew/vdb/VelocityGrid.h"

namespace curlew::app {

// What actions do on a GPU if their option device= asks for it. With `gpu`, it is an error if that is impossible; with
// `auto`, the processor does it. Both say where it was done.

/// The option device=.
Option deviceOption();
/// Whether it is `gpu`.
bool asksForGpu(const Arguments& a);

/// Moves points as advect() does, on a GPU; returns nothing if the processor is to do it. `otherwise`: why a GPU cannot
/// do what else the action is asked for; empty if it can.
std::optional<AdvectResult> advectedOnGpu(const Context& c, const Arguments& a, const FlowInTime& flow, double begin,
                                          Points& particles, const AdvectOptions& options, const std::string& otherwise,
                                          const Monitor& monitor);

/// Returns what moves positions for -warp, warp() itself for the processor.
Warper warperOf(const Context& c, const Arguments& a);

/// Returns what averages noise for -lic, convolved() itself for the processor.
LicConvolution licConvolutionOf(const Context& c, const Arguments& a);

/// Returns the source of velocities of -velocity, for VelocityGridOptions; empty for the processor.
std::function<VelocitySource(const Flow&)> velocitySourceOf(const Context& c, const Arguments& a, bool staggered);

/// The action -device.
Action deviceAction();

} // namespace curlew::app
