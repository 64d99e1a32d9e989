// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/ScalarField.h"
#include "curlew/math/Vec.h"

namespace curlew {

/// How large and how steep a noise is.
struct NoiseScale {
    double wavelength = 0; ///< World units: the field's own (ScalarField::wavelength), else measured.
    bool measured = false; ///< The field knows none: it is 7 times the rms deviation from the mean over `slope`, which
                           ///< for psrdnoise of one octave is one cell within 5 %.
    double slope = 0;      ///< Root mean square of |grad|, per world unit.
};

/// Of a field in and around a box: over the box, grown to at least 8 wavelengths along each axis, so that the figures
/// are those of the noise and not of the few swirls that fit the box. From the same 8192 pseudo-random positions (in
/// units of the box) at every call; the slope is within about 2 % of that of the whole noise. An infinite box stands
/// for -1 … 1. Any number of threads may call it. Throws ValueError if the field is constant or not finite there.
template <int N>
NoiseScale noiseScaleOf(const ScalarFieldN<N>& noise, const BoxN<N>& box);

} // namespace curlew
