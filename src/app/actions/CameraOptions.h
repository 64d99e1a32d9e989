// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Action.h"
#include "curlew/render/Camera.h"

namespace curlew::app {

/// What says from where a picture in perspective is taken, and how large it is: from, up, eye, target, fov, width,
/// height.
std::vector<Option> cameraOptions();

/// What the options say of the camera but for its place; ValueError for a target= without eye=.
CameraOptions viewpointOf(const Arguments& a);

/// The camera of these options; without eye=, it sees all of the box.
Camera cameraOf(const Arguments& a, const Box& subject);

} // namespace curlew::app
