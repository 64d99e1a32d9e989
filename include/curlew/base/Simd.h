// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace curlew {

/// The instruction sets that the kernels are compiled for. All give the same bits.
enum class Simd {
    scalar, ///< One position at a time; the only choice on processors other than x86-64.
    avx2,   ///< AVX2 and FMA.
    avx512  ///< AVX-512 F, BW, CD, DQ and VL.
};

/// Returns the instruction set that the kernels of this process use: the one that the environment variable CURLEW_SIMD
/// (scalar, avx2, avx512) names, else the best that the processor supports. It is chosen at the first call and never
/// changes. Throws ValueError if the variable names an unknown set, or one that the processor lacks. Safe to call from
/// any thread.
Simd activeSimd();

/// Returns the name as in CURLEW_SIMD.
const char* nameOf(Simd simd);

} // namespace curlew
