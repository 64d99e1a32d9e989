// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Simd.h"
#include "curlew/math/Arithmetic.h"

#include <utility>

namespace curlew {

// A kernel is a type with `template <class T> static void run(arguments…)`, written for numbers T (Arithmetic.h). It is
// compiled for T = float and double wherever it is used, and for lanes of them in files named *Kernels.cpp, which CMake
// compiles once per instruction set.

struct Avx2;
struct Avx512;

/// Runs a kernel on lanes of the instruction set S. Defined in LaneKernels.h and instantiated in *Kernels.cpp.
template <class S, class Kernel, class T, class... A>
void runOnLanes(A&... arguments);

/// Runs a kernel on numbers of type T, with the active instruction set (base/Simd.h). The kernel must be instantiated
/// for lanes.
template <class Kernel, class T, class... A>
void runKernel(A&... arguments) {
#if defined(__x86_64__)
    const Simd simd = activeSimd();
    if (simd == Simd::avx512) return runOnLanes<Avx512, Kernel, T>(arguments...);
    if (simd == Simd::avx2) return runOnLanes<Avx2, Kernel, T>(arguments...);
#endif
    Kernel::template run<T>(arguments...);
}

/// The same for a kernel whose lanes are consecutive numbers on a line of `length`, at least 8. Calls
/// run(begin, end, arguments…) for parts of the line. If a part has fewer numbers than there are lanes, its lanes may
/// begin before it; there are always enough numbers before its end.
template <class Kernel, class T, class... A>
void runOnLine(size_t length, A&... arguments) {
    constexpr size_t kBegin = 0;
#if defined(__x86_64__)
    constexpr size_t kWide = 16, kNarrow = 8; // lanes of AVX-512 and AVX2
    if (activeSimd() == Simd::avx512) {
        const size_t rest = length % kWide, wide = length < kWide ? 0 : rest > kNarrow ? length : length - rest;
        if (wide > 0) runOnLanes<Avx512, Kernel, T>(kBegin, wide, arguments...);
        if (wide < length) runOnLanes<Avx2, Kernel, T>(wide, std::as_const(length), arguments...);
        return;
    }
#endif
    runKernel<Kernel, T>(kBegin, std::as_const(length), arguments...);
}

} // namespace curlew
