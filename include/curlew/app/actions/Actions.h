// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Registry.h"

namespace curlew::app {

/// Returns all actions of Curlew, in the order in which the help lists them.
const Registry& registry();

} // namespace curlew::app
