// SPDX-License-Identifier: Apache-2.0
#pragma once

// Only for files named *Kernels.cpp: CMake compiles them once per instruction set, CURLEW_SIMD (cmake/Room.cmake).
// Every function that they use must be a template on lanes of that instruction set, or be inlined. Otherwise the linker
// may keep the AVX-512 copy of a shared function for all callers; tests/simd checks this.

#include "curlew/math/LaneTables.h"

namespace curlew {

// Flattened, because calls between functions of lanes pass them through memory, and the compiler prefers such calls to
// inlining.
template <class S, class Kernel, class T, class... A>
[[gnu::flatten]] void runOnLanes(A&... arguments) {
    Kernel::template run<Lanes<T, S>>(arguments...);
}

} // namespace curlew
