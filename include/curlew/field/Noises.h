// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/noise/GradientNoise.h"
#include "curlew/noise/PerlinNoise.h"
#include "curlew/noise/Psrd.h"
#include "curlew/noise/SimplexNoise.h"
#include "curlew/noise/SineNoise.h"
#include "curlew/noise/ValueNoise.h"

/// The list of noises: NOISE(name, class template, lowest dimension, highest dimension, summary) for each.
/// noiseField(), the kernels on lanes and `-noise type=` are generated from it.
#define CURLEW_NOISES(NOISE)                                                                               \
    NOISE("psrd", PsrdN, 2, 3, "tiling simplex noise with rotating gradients (Gustavson and McEwan 2021)") \
    NOISE("value", ValueNoise, 1, 3, "values at lattice vertices (Catlike Coding)")                        \
    NOISE("perlin", PerlinNoise, 1, 3, "gradients at lattice vertices (Perlin 2002, Catlike Coding)")      \
    NOISE("gradient", GradientNoise, 2, 3, "gradient noise with an integer hash (Quilez)")                 \
    NOISE("simplex", SimplexNoise, 2, 7, "simplex noise in up to 7 dimensions")                            \
    NOISE("sine", SineNoise, 1, 7, "a sum of plane waves, infinitely smooth")

// NOLINTBEGIN(bugprone-macro-parentheses): the arguments are template arguments
/// Expands DO(Noise<N>) for each dimension N from LOWEST (1, 2 or 3) to HIGHEST (3 to 7).
#define CURLEW_NOISE_DIMENSIONS(DO, Noise, LOWEST, HIGHEST) \
    CURLEW_NOISE_BELOW_3(DO, Noise, LOWEST) DO(Noise<3>) CURLEW_NOISE_ABOVE_3(DO, Noise, HIGHEST)
/// The same, only for dimensions below 3 and above 3.
#define CURLEW_NOISE_BELOW_3(DO, Noise, LOWEST) CURLEW_NOISE_FROM_##LOWEST(DO, Noise)
#define CURLEW_NOISE_ABOVE_3(DO, Noise, HIGHEST) CURLEW_NOISE_TO_##HIGHEST(DO, Noise)

#define CURLEW_NOISE_FROM_1(DO, Noise) DO(Noise<1>) DO(Noise<2>)
#define CURLEW_NOISE_FROM_2(DO, Noise) DO(Noise<2>)
#define CURLEW_NOISE_FROM_3(DO, Noise)
#define CURLEW_NOISE_TO_3(DO, Noise)
#define CURLEW_NOISE_TO_4(DO, Noise) DO(Noise<4>)
#define CURLEW_NOISE_TO_5(DO, Noise) CURLEW_NOISE_TO_4(DO, Noise) DO(Noise<5>)
#define CURLEW_NOISE_TO_6(DO, Noise) CURLEW_NOISE_TO_5(DO, Noise) DO(Noise<6>)
#define CURLEW_NOISE_TO_7(DO, Noise) CURLEW_NOISE_TO_6(DO, Noise) DO(Noise<7>)
// NOLINTEND(bugprone-macro-parentheses)
