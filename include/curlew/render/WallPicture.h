// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Domain.h"
#include "curlew/picture/Image.h"
#include "curlew/render/Camera.h"
#include "curlew/render/Surface.h"

namespace curlew {

/// The wall of a domain as a surface of triangles, which rays meet fast whatever the wall is made of: from samples of
/// its distance, 192 along its longest edge, where it has a box, else along that of the domain. Throws ValueError for a
/// domain without a wall or with an infinite box, and if the wall does not meet the box.
Surface wallSurface(const Domain& domain, const Monitor& monitor = {});

/// A picture of an obstacle: dull and dark, before a plain background (display values), with the channels R, G, B, A
/// and Z of shadeSurface(), so that what is drawn into it is hidden behind the obstacle. Throws as wallSurface().
Image obstaclePicture(const Domain& domain, const Camera& camera, const Vec3f& background, const Monitor& monitor = {});

} // namespace curlew
