// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Action.h"

namespace curlew::app {

/// What to say if an input needs `wanted` objects and only `found` are left for it; `others` of its kinds are there in
/// all.
std::string missing(const Input& input, size_t wanted, size_t found, size_t others);

} // namespace curlew::app
