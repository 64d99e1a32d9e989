// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Arguments.h"
#include "curlew/track/Reproject.h"

namespace curlew::app {

class Context;

/// Implements -advect loop=: outputs the points at their positions on their loops at duration=. The result is a
/// function of the flow, the points and that time.
void loopAction(Context& context, const Arguments& arguments, const ReprojectionOptions& reprojection);

} // namespace curlew::app
