// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/ScalarField.h"
#include "curlew/math/Vec.h"

namespace curlew {

/// The wavelength and the rms gradient of a noise.
struct NoiseScale {
    double wavelength = 0; ///< World units. The field's own (ScalarField::wavelength) or measured.
    bool measured = false; ///< Whether the wavelength is measured: 7 times the rms deviation from the mean over
                           ///< `slope`. For psrdnoise of one octave this is one cell within 5 %.
    double slope = 0;      ///< Root mean square of |grad|, per world unit.
};

/// Measures a field in and around a box. The box is enlarged to at least 8 wavelengths along each axis, so the results
/// describe the noise and not only the few swirls that fit into the box. Uses the same 8192 pseudo-random positions
/// (relative to the box) at every call. The slope is within about 2 % of that of the whole noise. An infinite box is
/// replaced by -1 … 1. Safe to call from any number of threads. Throws ValueError if the field is constant or not
/// finite there.
template <int N>
NoiseScale noiseScaleOf(const ScalarFieldN<N>& noise, const BoxN<N>& box);

} // namespace curlew
