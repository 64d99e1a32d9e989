// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Action.h"
#include "curlew/render/Camera.h"

namespace curlew::app {

/// The options for the viewpoint and size of a picture in perspective: from, up, eye, aim, fov, width, height.
std::vector<Option> cameraOptions();

/// The option for the region that the camera shows. `fallback`: for the help, the region without it.
Option viewBoxOption(const std::string& fallback);

/// Returns the camera options except for the position. Throws ValueError if aim= is given without eye=.
CameraOptions viewpointOf(const Arguments& a);

/// Returns the camera for these options. Without eye=, it frames the whole box.
Camera cameraOf(const Arguments& a, const Box& subject);

} // namespace curlew::app
