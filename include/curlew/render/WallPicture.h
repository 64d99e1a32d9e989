// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Domain.h"
#include "curlew/picture/Image.h"
#include "curlew/render/Camera.h"
#include "curlew/render/Surface.h"

namespace curlew {

/// Returns the wall of a domain as a triangle surface, whose ray tracing is fast however complex the wall is. The
/// triangles come from samples of the wall's distance, 192 along the longest edge of the shape's box, or of the
/// domain's box if the shape is unbounded. Throws ValueError if the domain has no wall or an infinite box, or the wall
/// does not meet the box.
Surface wallSurface(const Domain& domain, const Monitor& monitor = {});

/// Returns a picture of an obstacle, dull and dark, on a plain background (display values). It has the channels R, G,
/// B, A and Z of shadeSurface(), so the obstacle hides what is drawn behind it. Throws like wallSurface().
Image obstaclePicture(const Domain& domain, const Camera& camera, const Vec3f& background, const Monitor& monitor = {});

} // namespace curlew
