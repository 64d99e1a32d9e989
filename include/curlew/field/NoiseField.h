// SPDX-License-Identifier: Apache-2.0
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
    /// Of noises whose gradients turn (Psrd): the alpha of each octave over that of the octave before. With 2, octave k
    /// turns by 2^k alpha: within an octave all gradients turn by the same angle, so that swirls of similar size move
    /// alike (Gustavson and McEwan 2021, §5), and smaller ones turn faster (Perlin and Neyret 2001). With a whole
    /// number a full turn of the first octave is one of all, whatever the lacunarity. 1: all octaves turn alike.
    double octaveAlpha = 2;
};

/// Octaves of a noise as a field. Each noise has its own options; a period given there is that of the first octave, and
/// all octaves tile if lacunarity is a whole number. Throws ValueError for options out of range.
template <class Noise>
ScalarFieldN<Noise::kDimension> noiseField(const typename Noise::Options& noise = {},
                                           const OctaveOptions& options = {});

} // namespace curlew
