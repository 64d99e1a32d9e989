// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Action.h"

namespace curlew::app {

/// Returns the message for an input that needs `wanted` objects when only `found` are left. `others` is the total
/// number of objects of its kinds. `grids`: there are scalar grids that are not level sets.
std::string missing(const Input& input, size_t wanted, size_t found, size_t others, bool grids);

} // namespace curlew::app
