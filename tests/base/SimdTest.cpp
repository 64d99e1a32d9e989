// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Simd.h"
#include "support/Variable.h"

#include <catch2/catch.hpp>

#include <array>
#include <string>
#include <thread>

using namespace curlew;

// What the command says to a wrong CURLEW_SIMD is in app/SimdBytesTest.cpp: the choice is made once in a process.

namespace {

std::string best() {
#if defined(__x86_64__)
    // Of the processors that have these, all have the other parts.
    if (__builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq")) return "avx512";
    if (__builtin_cpu_supports("avx2")) return "avx2";
#endif
    return "scalar";
}

} // namespace

TEST_CASE("every instruction set has a name of its own", "[simd]") {
    CHECK(nameOf(Simd::scalar) == std::string("scalar"));
    CHECK(nameOf(Simd::avx2) == std::string("avx2"));
    CHECK(nameOf(Simd::avx512) == std::string("avx512"));
}

TEST_CASE("a process uses what it was asked for or the best there is", "[simd]") {
    const char* asked = std::getenv("CURLEW_SIMD");
    CHECK(nameOf(activeSimd()) == (asked && *asked ? std::string(asked) : best()));
}

TEST_CASE("the choice of instructions is the same in every thread and for good", "[simd]") {
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
