// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Simd.h"

#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <array>
#include <cstdlib>
#include <string_view>

namespace curlew {

namespace {

constexpr std::array kAll{Simd::avx512, Simd::avx2, Simd::scalar}; // best first

bool supported([[maybe_unused]] Simd simd) {
#if defined(__x86_64__)
    if (simd == Simd::avx2) return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    if (simd == Simd::avx512)
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
               __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
               __builtin_cpu_supports("avx512vl");
#endif
    return simd == Simd::scalar;
}

Simd choose() {
    const char* asked = std::getenv("CURLEW_SIMD");
    for (const Simd simd : kAll) {
        if (asked && *asked && std::string_view(asked) != nameOf(simd)) continue;
        if (supported(simd)) return simd;
        if (asked && *asked)
            throw ValueError(fmt::format(
                "CURLEW_SIMD={}: this processor does not support it; unset it to use the best set available", asked));
    }
    throw ValueError(fmt::format("CURLEW_SIMD={} is unknown; give avx512, avx2 or scalar, or unset it", asked));
}

} // namespace

const char* nameOf(Simd simd) {
    switch (simd) {
        case Simd::avx512:
            return "avx512";
        case Simd::avx2:
            return "avx2";
        case Simd::scalar:
            break;
    }
    return "scalar";
}

Simd activeSimd() {
    static const Simd kChosen = choose();
    return kChosen;
}

} // namespace curlew
