// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Simd.h"
#include "curlew/math/Arithmetic.h"

namespace curlew {

// A kernel is a type with `template <class T> static void run(arguments…)`, written on numbers T (Arithmetic.h). It is
// compiled three times: for T = float and double here, and for their lanes in files named *Kernels.cpp, which CMake
// compiles once for each instruction set.

struct Avx2;
struct Avx512;

/// Runs a kernel on the lanes of one instruction set; defined in LaneKernels.h, instantiated in the *Kernels.cpp.
template <class S, class Kernel, class T, class... A>
void runOnLanes(A&... arguments);

/// Runs a kernel that has been instantiated for lanes, in numbers T, on the best that there is (base/Simd.h).
template <class Kernel, class T, class... A>
void runKernel(A&... arguments) {
#if defined(__x86_64__)
    const Simd simd = activeSimd();
    if (simd == Simd::avx512) return runOnLanes<Avx512, Kernel, T>(arguments...);
    if (simd == Simd::avx2) return runOnLanes<Avx2, Kernel, T>(arguments...);
#endif
    Kernel::template run<T>(arguments...);
}

} // namespace curlew
