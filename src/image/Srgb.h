#pragma once

#include "curlew/math/Vec.h"

namespace curlew {

/// Linear sRGB of the CIE 1931 tristimulus values X, Y, Z, where white (D65) has Y = 1; not clamped (IEC 61966-2-1).
inline Vec3d linearFromXyz(const Vec3d& xyz) {
    return {{3.2404542 * xyz[0] - 1.5371385 * xyz[1] - 0.4985314 * xyz[2],
             -0.9692660 * xyz[0] + 1.8760108 * xyz[1] + 0.0415560 * xyz[2],
             0.0556434 * xyz[0] - 0.2040259 * xyz[1] + 1.0572252 * xyz[2]}};
}

} // namespace curlew
