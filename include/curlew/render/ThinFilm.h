// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"

#include <vector>

namespace curlew {

/// The colours of a thin film in air: a soap bubble. The part of the light that it reflects is Airy's sum over all
/// reflections between its faces (Born and Wolf, Principles of Optics, section 7.6),
///   R = 2 r² (1 - cos δ) / (1 + r⁴ - 2 r² cos δ),  δ = 4π n d cos θ' / λ,
/// for either polarisation with its own r of Fresnel, their mean integrated over 380 to 780 nm with the CIE 1931 curves
/// (as Wyman, Sloan and Shirley fit them, JCGT 2(2), 2013). What reflects everything is white, (1, 1, 1).
///
/// Tabulated: within 0.01 of the integral, but for the last three degrees before the film is seen along itself.
/// Immutable, safe to share between threads.
class ThinFilm {
  public:
    /// Up to this thickness, nm. Throws ValueError for an index that is not above 1, and a thickness that is not
    /// positive.
    explicit ThinFilm(double greatestThickness = 1200, double refractiveIndex = 1.33);

    /// What is reflected, as linear R, G, B, at a thickness in nm (clamped) and the cosine of the angle of incidence.
    Vec3d reflectance(double thickness, double cosine) const;

    /// The integral itself.
    static Vec3d integrated(double thickness, double cosine, double refractiveIndex);

  private:
    double mGreatest;
    std::vector<Vec3f> mTable; ///< By thickness, then the square root of the cosine.
};

} // namespace curlew
