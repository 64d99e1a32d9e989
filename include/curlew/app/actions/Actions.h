// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Registry.h"

namespace curlew::app {

/// All actions of Curlew, in the order in which help lists them.
const Registry& registry();

} // namespace curlew::app
