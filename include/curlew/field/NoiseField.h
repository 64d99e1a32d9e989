// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Noises.h"
#include "curlew/field/ScalarField.h"

namespace curlew {

/// How the octaves of a noise, copies at rising frequencies, are summed (fractal Brownian motion, fBm). The terms are
/// those of Flick, "Noise Derivatives", Catlike Coding: octaves, lacunarity, persistence.
struct OctaveOptions {
    double frequency = 1;  ///< Frequency of the first octave, cycles per world unit.
    int octaves = 1;       ///< 1 … 32.
    double lacunarity = 2; ///< Ratio of the frequencies of successive octaves.
    double gain = 0.5;     ///< Ratio of the amplitudes of successive octaves ("persistence").
    double amplitude = 1;  ///< Amplitude of the first octave; with `normalize`, of the whole sum.
    bool normalize = true; ///< Divide by the sum of the octaves' amplitudes: the range does not depend on `octaves`.
    /// Billow (Perlin: turbulence) t. If t > 0, each octave n is replaced by sqrt(n² + t²) - t, a rounded |n|. With
    /// |n| itself the field would not be C², nor a flow of it divergence-free. A smaller t gives sharper creases.
    /// Allowed: 0, or 1e-9 … 1e9.
    double billow = 0;
    /// Gradient advection (Gustavson and McEwan 2021, Fig. 1c), a domain warp: each octave is displaced by `warp` times
    /// the sum of the gradients of the octaves before it (octave k weighted by gain^k), in cells of that octave. A
    /// negative value moves fine detail onto the crests. This costs a degree of smoothness: the sum is C² for noises
    /// that are C³ (Psrd2, SimplexNoise of power 4, SineNoise). For others, its Hessian jumps where their third
    /// derivatives do.
    double warp = 0;
    /// For noises with rotating gradients (Psrd): the ratio of alpha between successive octaves. With 2, octave k
    /// rotates by 2^k alpha. Within an octave all gradients rotate by the same angle, so swirls of similar size move
    /// alike (Gustavson and McEwan 2021, §5), and smaller swirls rotate faster (flow noise, Perlin and Neyret 2001). If
    /// it is an integer, a full turn of the first octave is a full turn of all octaves, whatever the lacunarity. With
    /// 1, all octaves rotate alike.
    double octaveAlpha = 2;
};

/// Returns the sum of octaves of a noise as a field. `noise` holds the options of the noise; its period applies to the
/// first octave. All octaves tile if the lacunarity is an integer. Throws ValueError if an option is out of range.
template <class Noise>
ScalarFieldN<Noise::kDimension> noiseField(const typename Noise::Options& noise = {},
                                           const OctaveOptions& options = {});

} // namespace curlew
