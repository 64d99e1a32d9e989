// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Action.h"

namespace curlew::app {

/// Returns the message for an input that needs `wanted` objects when only `found` are left. `others` is the total
/// number of objects of its kinds.
std::string missing(const Input& input, size_t wanted, size_t found, size_t others);

} // namespace curlew::app
