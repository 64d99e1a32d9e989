// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Simd.h"
#include "support/Catch.h"
#include "support/Variable.h"

#include <array>
#include <string>
#include <thread>

using namespace curlew;

// app/SimdBytesTest.cpp tests the errors for a wrong CURLEW_SIMD, since a process chooses its instruction set once.

namespace {

std::string best() {
#if defined(__x86_64__)
    // All processors with these features have the other required ones.
    if (__builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq")) return "avx512";
    if (__builtin_cpu_supports("avx2")) return "avx2";
#endif
    return "scalar";
}

} // namespace

TEST_CASE("activeSimd: is the set named by CURLEW_SIMD or the best available", "[base][simd]") {
    const char* asked = std::getenv("CURLEW_SIMD");
    CHECK(nameOf(activeSimd()) == (asked && *asked ? std::string(asked) : best()));
}

TEST_CASE("activeSimd: is the same in every thread and never changes", "[base][simd]") {
    const Simd chosen = activeSimd();
    const test::Variable other("CURLEW_SIMD", chosen == Simd::scalar ? "avx2" : "scalar");
    CHECK(activeSimd() == chosen);
    std::array<Simd, 4> seen{};
    {
        std::array<std::jthread, 4> threads;
        for (size_t k = 0; k < threads.size(); ++k) threads[k] = std::jthread([&seen, k] { seen[k] = activeSimd(); });
    }
    for (const Simd simd : seen) CHECK(simd == chosen);
}
