// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"

namespace curlew {

/// A ray; `direction` is a unit vector.
struct Ray {
    Vec3d origin, direction;
};

} // namespace curlew
