#pragma once

#include "curlew/field/Noises.h"
#include "curlew/field/ScalarField.h"

namespace curlew {

/// How copies of a noise at rising frequencies are summed (Flick, "Noise Derivatives", Catlike Coding: octaves,
/// lacunarity, persistence).
struct OctaveOptions {
    double frequency = 1;  ///< Of the first octave, cycles per world unit.
    int octaves = 1;       ///< 1 … 32.
    double lacunarity = 2; ///< Each octave's frequency over that of the octave before.
    double gain = 0.5;     ///< Each octave's amplitude over that of the octave before ("persistence").
    double amplitude = 1;  ///< Of the first octave before, of the whole sum after normalising.
    bool normalize = true; ///< Divide by the sum of the octaves' amplitudes: as many octaves as you like, same range.
    /// Above 0: of each octave not n but sqrt(n² + t²) - t is summed, a rounded |n|. With |n| itself the field
    /// would not be C², nor a flow of it divergence-free; the smaller t, the sharper the creases. 0: n itself;
    /// otherwise 1e-9 … 1e9.
    double turbulence = 0;
    /// Gradient advection (Gustavson and McEwan 2021, Fig. 1c): each octave is displaced by `warp` times the sum
    /// of the octaves' gradients before it, in cells of that octave; negative lets the fine detail pile up on the
    /// crests. That costs a degree of smoothness: the sum is C² for noises that are C³ (Psrd2, SimplexNoise of power 4,
    /// SineNoise); for the others its Hessian jumps where their third derivatives do.
    double warp = 0;
};

/// Octaves of a noise as a field. Each noise has its own options; a period given there is that of the first octave, and
/// all octaves tile if lacunarity is a whole number. Throws ValueError for options out of range.
template <class Noise>
ScalarFieldN<Noise::kDimension> noiseField(const typename Noise::Options& noise = {},
                                           const OctaveOptions& options = {});

} // namespace curlew
