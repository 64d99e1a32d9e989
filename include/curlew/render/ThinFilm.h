// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"

#include <vector>

namespace curlew {

/// The colours of a thin film in air, such as a soap bubble. The reflectance is Airy's sum over all reflections between
/// the film's faces (Born and Wolf, Principles of Optics, section 7.6),
///   R = 2 r² (1 - cos δ) / (1 + r⁴ - 2 r² cos δ),  δ = 4π n d cos θ' / λ,
/// for each polarisation with its own Fresnel coefficient r. The mean of both is integrated over 380 to 780 nm with the
/// CIE 1931 curves (as fitted by Wyman, Sloan and Shirley, JCGT 2(2), 2013). Total reflection is white, (1, 1, 1).
///
/// Tabulated: within 0.01 of the integral, except in the last three degrees before grazing incidence. Immutable, safe
/// to share between threads.
class ThinFilm {
  public:
    /// Builds the table up to this thickness, nm. Throws ValueError if the index is not above 1 or the thickness is not
    /// positive.
    explicit ThinFilm(double greatestThickness = 1200, double refractiveIndex = 1.33);

    /// Returns the reflectance as linear R, G, B, at a thickness in nm (clamped) and the cosine of the angle of
    /// incidence. NaN gives black.
    Vec3d reflectance(double thickness, double cosine) const;

    /// Returns the integral itself, without the table.
    static Vec3d integrated(double thickness, double cosine, double refractiveIndex);

  private:
    double mGreatest;
    std::vector<Vec3f> mTable; ///< By thickness, then the square root of the cosine.
};

} // namespace curlew
