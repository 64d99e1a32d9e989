// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/run/Context.h"
#include "curlew/track/WallVelocity.h"

namespace curlew::app {

/// Warns, once per node, if a rigid wall pushes the air in its layer at several times its own speed. `domain`: that of
/// the flow.
void warnOfFastAir(const Context& c, const WallVelocity& velocity, const Domain& domain);

/// Warns, once per node, if the wall of a flow moves so far between `begin` and `time` seconds later that its motion in
/// between is unknown. `consequence`: what may happen then, for the message. `inLayer`: the air that the wall displaces
/// stays in its layer, so warnOfFastAir() applies.
void warnOfMovingWall(const Context& c, const FlowInTime& flow, double begin, double time, std::string_view consequence,
                      bool inLayer = true);

/// The same for the time from the previous frame to this one.
void warnOfMovingWall(const Context& c, const FlowInTime& flow, std::string_view consequence, bool inLayer = true);

} // namespace curlew::app
