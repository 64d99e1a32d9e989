// SPDX-License-Identifier: Apache-2.0
// The limits of the processor: no other case can be faster than its multiply-adds and stores allow.

#include "Cases.h"

#include <immintrin.h>

#include <array>
#include <cstdlib>
#include <memory>

namespace curlew::bench {

namespace {

// Number of sums: enough to hide the latency of a multiply-add (4 cycles, 2 per cycle), and few enough for the 16
// registers of AVX2.
constexpr int kSums = 12;
constexpr int kRounds = 4096;
constexpr int kLoads = 12 * 256; ///< Loads of the loading cases: 24 KiB of doubles, which fit the L1 cache.

// Each function is compiled for the instruction set that it measures; the rest of the file runs on any processor.

[[gnu::target("avx2,fma")]] float multiplyAddAvx2(float factor, float term) {
    const __m256 a = _mm256_set1_ps(factor), b = _mm256_set1_ps(term);
    __m256 sum[kSums];
    for (auto& s : sum) s = b;
    for (int round = 0; round < kRounds; ++round)
#pragma GCC unroll 12
        for (auto& s : sum) s = _mm256_fmadd_ps(s, a, b);
    for (const auto& s : sum) sum[0] = _mm256_add_ps(sum[0], s);
    return _mm256_cvtss_f32(sum[0]);
}

[[gnu::target("avx512f")]] float multiplyAddAvx512(float factor, float term) {
    const __m512 a = _mm512_set1_ps(factor), b = _mm512_set1_ps(term);
    __m512 sum[kSums];
    for (auto& s : sum) s = b;
    for (int round = 0; round < kRounds; ++round)
#pragma GCC unroll 12
        for (auto& s : sum) s = _mm512_fmadd_ps(s, a, b);
    for (const auto& s : sum) sum[0] = _mm512_add_ps(sum[0], s);
    return _mm512_cvtss_f32(sum[0]);
}

[[gnu::target("avx2,fma")]] double loadMultiplyAddAvx2(const double* data) {
    __m256d sum[kSums];
    for (auto& s : sum) s = _mm256_setzero_pd();
    const __m256d a = _mm256_set1_pd(0.999);
    for (const double* p = data; p < data + kLoads; p += 4 * kSums)
#pragma GCC unroll 12
        for (int k = 0; k < kSums; ++k) sum[k] = _mm256_fmadd_pd(_mm256_loadu_pd(p + 4 * k), a, sum[k]);
    for (const auto& s : sum) sum[0] = _mm256_add_pd(sum[0], s);
    return _mm256_cvtsd_f64(sum[0]);
}

[[gnu::target("avx512f")]] double loadMultiplyAddAvx512(const double* data) {
    __m512d sum[kSums];
    for (auto& s : sum) s = _mm512_setzero_pd();
    const __m512d a = _mm512_set1_pd(0.999);
    for (const double* p = data; p < data + kLoads; p += 8 * kSums)
#pragma GCC unroll 12
        for (int k = 0; k < kSums; ++k) sum[k] = _mm512_fmadd_pd(_mm512_loadu_pd(p + 8 * k), a, sum[k]);
    for (const auto& s : sum) sum[0] = _mm512_add_pd(sum[0], s);
    return _mm512_cvtsd_f64(sum[0]);
}

void multiplyAdd(benchmark::State& state, float (*run)(float, float), int lanes) {
    float factor = 0.999F, term = 0.001F;
    for (auto _ : state) {
        benchmark::DoNotOptimize(factor); // prevents the compiler from hoisting the work out of the loop
        benchmark::DoNotOptimize(run(factor, term));
    }
    state.SetItemsProcessed(state.iterations() * kRounds * kSums * lanes);
}

void loadMultiplyAdd(benchmark::State& state, double (*run)(const double*)) {
    alignas(64) std::array<double, kLoads> data;
    data.fill(1);
    for (auto _ : state) {
        benchmark::DoNotOptimize(data);
        benchmark::DoNotOptimize(run(data.data()));
    }
    state.SetItemsProcessed(state.iterations() * kLoads);
}

constexpr size_t kBytes = size_t{256} << 20; ///< Many times the size of the last-level cache.

struct Free {
    void operator()(float* memory) const { std::free(memory); }
};
std::unique_ptr<float, Free> uninitialised() {
    return std::unique_ptr<float, Free>(static_cast<float*>(std::aligned_alloc(4096, kBytes)));
}

void storeAll(float* memory) {
    const __m256 value = _mm256_set1_ps(1);
    for (size_t n = 0; n < kBytes / sizeof(float); n += 8) _mm256_store_ps(memory + n, value);
    benchmark::ClobberMemory();
}

void store(benchmark::State& state) {
    const auto memory = uninitialised();
    storeAll(memory.get());
    for (auto _ : state) storeAll(memory.get());
    state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(kBytes));
}

/// Stores that bypass the caches.
void storeStreaming(benchmark::State& state) {
    const auto memory = uninitialised();
    storeAll(memory.get());
    const __m256 value = _mm256_set1_ps(2);
    for (auto _ : state) {
        for (size_t n = 0; n < kBytes / sizeof(float); n += 8) _mm256_stream_ps(memory.get() + n, value);
        _mm_sfence();
        benchmark::ClobberMemory();
    }
    state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(kBytes));
}

/// Stores to memory that is new to the process, like the leaves of a new grid.
void storeFresh(benchmark::State& state) {
    for (auto _ : state) {
        const auto memory = uninitialised();
        storeAll(memory.get());
    }
    state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(kBytes));
}

} // namespace

void registerRoofline() {
    add("roofline/fma_float/avx2", [](auto& state) { multiplyAdd(state, multiplyAddAvx2, 8); });
    add("roofline/load_fma_double/avx2", [](auto& state) { loadMultiplyAdd(state, loadMultiplyAddAvx2); });
    if (__builtin_cpu_supports("avx512f")) {
        add("roofline/fma_float/avx512", [](auto& state) { multiplyAdd(state, multiplyAddAvx512, 16); });
        add("roofline/load_fma_double/avx512", [](auto& state) { loadMultiplyAdd(state, loadMultiplyAddAvx512); });
    }
    add("roofline/store/ordinary", store);
    add("roofline/store/streaming", storeStreaming);
    add("roofline/store/fresh_memory", storeFresh);
}

} // namespace curlew::bench
