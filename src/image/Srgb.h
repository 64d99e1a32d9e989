#pragma once

#include "curlew/math/Vec.h"

#include <cmath>

// The colours of displays (IEC 61966-2-1).
namespace curlew {

/// The display value of an amount of light.
inline double srgbEncoded(double linear) {
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

inline double srgbDecoded(double display) {
    return display <= 0.04045 ? display / 12.92 : std::pow((display + 0.055) / 1.055, 2.4);
}

/// Linear R, G, B of the CIE 1931 tristimulus values X, Y, Z, where white (D65) has Y = 1; not clamped.
inline Vec3d srgbLinear(const Vec3d& xyz) {
    return {{3.2404542 * xyz[0] - 1.5371385 * xyz[1] - 0.4985314 * xyz[2],
             -0.9692660 * xyz[0] + 1.8760108 * xyz[1] + 0.0415560 * xyz[2],
             0.0556434 * xyz[0] - 0.2040259 * xyz[1] + 1.0572252 * xyz[2]}};
}

} // namespace curlew
