// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Action.h"

namespace curlew::app {

Action advectAction();

} // namespace curlew::app
