// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Action.h"

namespace curlew::app {

/// -probe: evaluates fields, flows and level sets at the points of a file.
Action probeAction();

} // namespace curlew::app
