// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/run/Context.h"

namespace curlew::app {

/// Warns, once per node, if the wall of a flow moves so far between `begin` and `time` seconds later that its motion in
/// between is unknown. `consequence`: what may happen then, for the message.
void warnOfLostWall(const Context& c, const FlowInTime& flow, double begin, double time, std::string_view consequence);

/// The same for the time from the previous frame to this one.
void warnOfLostWall(const Context& c, const FlowInTime& flow, std::string_view consequence);

} // namespace curlew::app
