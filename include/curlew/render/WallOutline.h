// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Domain.h"
#include "curlew/picture/Image.h"
#include "curlew/render/Camera.h"

namespace curlew {

/// The wall of a domain as thin glass: an image of one channel, "outline", from 0 (nothing) towards 1 (its edge). Each
/// ray goes through the whole box of the domain, and every passage through the wall counts by (1 - |n·v|)³, n the
/// wall's normal and v the ray, those behind the first for less; just beside the silhouette it fades out within two
/// pixels. Computed at half the resolution. Throws ValueError for a domain without a wall or with an infinite box.
Image wallOutline(const Domain& domain, const Camera& camera, const Monitor& monitor = {});

/// The same in the colour of glass, this bright, as light on a picture of the camera's size (developed()). Throws
/// ValueError also for a brightness that is not positive.
Image withWallOutline(Image picture, const Domain& domain, const Camera& camera, double brightness,
                      const Monitor& monitor = {});

} // namespace curlew
