// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Action.h"

namespace curlew::app {

/// Shapes, level sets and meshes combined; meshes and grids moved. They are listed after the shapes.
Registry solidActions();

} // namespace curlew::app
