// SPDX-License-Identifier: Apache-2.0
#pragma once

// Only for files named *Kernels.cpp: they are compiled once for each instruction set, CURLEW_SIMD (cmake/Room.cmake).
// What they use must depend on lanes of that instruction set or be inlined, or the linker may take AVX-512 code for
// everyone; tests/simd looks for that.

#include "curlew/math/LaneTables.h"

namespace curlew {

// Flat, because a call between functions of lanes passes them through memory, and is what the compiler prefers.
template <class S, class Kernel, class T, class... A>
[[gnu::flatten]] void runOnLanes(A&... arguments) {
    Kernel::template run<Lanes<T, S>>(arguments...);
}

} // namespace curlew
