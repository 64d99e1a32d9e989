// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Action.h"

namespace curlew::app {

/// The actions that combine shapes, level sets and meshes, or move meshes and grids. The help lists them after the
/// shapes.
Registry solidActions();

} // namespace curlew::app
