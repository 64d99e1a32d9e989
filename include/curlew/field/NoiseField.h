#pragma once

#include "curlew/field/ScalarField.h"
#include "curlew/noise/Psrd.h"

namespace curlew {

/// How copies of a noise at rising frequencies are summed (papers/001: octaves, lacunarity, persistence).
struct OctaveOptions {
    double frequency = 1;  ///< Of the first octave, cycles per world unit.
    int octaves = 1;       ///< 1 … 32.
    double lacunarity = 2; ///< Each octave's frequency over that of the octave before.
    double gain = 0.5;     ///< Each octave's amplitude over that of the octave before ("persistence").
    double amplitude = 1;  ///< Of the first octave before, of the whole sum after normalising.
    bool normalize = true; ///< Divide by the sum of the octaves' amplitudes: as many octaves as you like, same range.
};

/// Σ amplitude gainᵏ psrd(frequency lacunarityᵏ x). With the default options: the noise itself.
/// A period tiles the sum, if the lacunarity is a whole number (ValueError otherwise): in world units it is
/// period / frequency. Throws ValueError for octaves out of range, and frequencies that are not finite and positive.
ScalarField psrdField(const PsrdOptions& noise = {}, const OctaveOptions& options = {});

} // namespace curlew
