// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Domain.h"
#include "curlew/picture/Image.h"
#include "curlew/render/Camera.h"

namespace curlew {

/// Renders the wall of a domain as thin glass: an image of one channel, "outline", from 0 (nothing) towards 1 (the
/// edge). Each ray passes through the whole box of the domain, or ends in an obstacle (Side::outside). Every crossing
/// of the wall adds (1 - |n·v|)³, where n is the wall's normal and v the ray direction; crossings after the first have
/// a lower weight. Outside the silhouette the outline fades out within two pixels. Computed at half the
/// resolution where it is smooth, and with four samples per pixel at edges. Throws ValueError if the domain has no wall
/// or an infinite box.
Image wallOutline(const Domain& domain, const Camera& camera, const Monitor& monitor = {});

/// Adds the outline to a picture of the camera's size as light in the colour of glass with this brightness
/// (developed()). Also throws ValueError if the brightness is not positive.
Image withWallOutline(Image picture, const Domain& domain, const Camera& camera, double brightness,
                      const Monitor& monitor = {});

} // namespace curlew
