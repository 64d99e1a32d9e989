// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/actions/Actions.h"
#include "curlew/app/registry/Options.h"
#include "curlew/app/run/Context.h"

namespace curlew::app {

// The actions of each group, in the order in which the help lists them.
Registry fileActions();
Registry shapeActions();
Registry noiseActions();
Registry fieldActions();
Registry sampledActions();
Registry meshActions();
Registry wallActions();
Registry flowActions();
Registry windActions();
Registry gridFlowActions();
Registry railActions();
Registry carryActions();
Registry gridActions();
Registry spectrumActions();
Registry pointActions();
Registry emitActions();
Registry jitterActions();
Registry curveActions();
Registry levelSetActions();
Registry imageActions();
Registry surfaceActions();
Registry splatActions();
Registry pictureActions();
Registry reportActions();
Registry programActions();

} // namespace curlew::app
