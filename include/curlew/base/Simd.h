// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace curlew {

/// The instruction sets that the kernels are compiled for. All give the same bits.
enum class Simd {
    scalar, ///< One position at a time; the only one on other processors than x86-64.
    avx2,   ///< AVX2 and FMA.
    avx512  ///< AVX-512 F, BW, CD, DQ and VL.
};

/// What the kernels of this process use: the best that the processor has, or what the environment variable CURLEW_SIMD
/// (scalar, avx2, avx512) asks for. Chosen at the first call, for good. Throws ValueError where the variable names
/// something unknown, or something that the processor lacks. Safe from any thread.
Simd activeSimd();

/// As CURLEW_SIMD has it.
const char* nameOf(Simd simd);

} // namespace curlew
