// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Action.h"

namespace curlew::app {

/// Returns the output of an action that makes a 3D flow, whatever the dimensions of its inputs.
inline std::vector<Object> flowInSpace(const Arguments&, const std::vector<std::vector<Object>>&, const World&) {
    return {{.kind = Kind::flow, .dimension = 3, .name = "flow"}};
}

} // namespace curlew::app
