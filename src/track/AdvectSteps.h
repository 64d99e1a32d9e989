#pragma once

#include "curlew/track/Advect.h"

namespace curlew::detail {

/// advect() in a flow whose magnitudes are known: for those who take it step by step.
AdvectResult advectKnowing(const Flow& flow, const FlowMagnitudes& typical, Points& particles,
                           const AdvectOptions& options, const Monitor& monitor);

} // namespace curlew::detail
