// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Domain.h"

namespace curlew {

/// The steps along each axis of the low-discrepancy sequence R_N, as fractions of 2^64: 1/φ, 1/φ² … of the root of
/// φ^(N+1) = φ + 1 (Roberts 2018, "The unreasonable effectiveness of quasirandom sequences").
template <int N>
constexpr std::array<uint64_t, size_t{N}> lowDiscrepancySteps() {
    double root = 2;
    for (int k = 0; k < 50; ++k) { // Newton's method
        double power = 1;
        for (int i = 0; i < N; ++i) power *= root;
        root -= (power * root - root - 1) / ((N + 1) * power - 1);
    }
    std::array<uint64_t, size_t{N}> steps{};
    double step = 0x1p64;
    for (auto& word : steps) word = static_cast<uint64_t>(step /= root);
    return steps;
}

/// Calls `use` with batches of the points in the domain, taken from candidates begin … end - 1 of a fixed
/// low-discrepancy sequence in its box. Measured for the rms speed of noise, the errors of 2^15 of these are 0.06 to
/// 0.3 %, of 2^17 random ones 0.15 to 0.2 %.
template <int N, class Use>
void visitSamples(const DomainN<N>& domain, size_t begin, size_t end, const Use& use) {
    constexpr auto kSteps = lowDiscrepancySteps<N>();
    const Vec<double, N> size = domain.box.size();
    PointBatchN<N> candidates, points;
    const auto flush = [&] {
        if (points.size > 0) use(points);
        points.size = 0;
    };
    const auto sift = [&] {
        std::array<bool, kBatch> allowed;
        std::array<double, kBatch> distance;
        classify(domain, candidates, allowed, distance);
        for (int i = 0; i < candidates.size; ++i) {
            if (!allowed[static_cast<size_t>(i)]) continue;
            points.push(candidates[i]);
            if (points.full()) flush();
        }
        candidates.size = 0;
    };
    for (size_t k = begin; k < end; ++k) {
        Vec<double, N> p;
        for (int axis = 0; axis < N; ++axis) {
            const uint64_t word =
                (uint64_t{1} << 63) + k * kSteps[static_cast<size_t>(axis)]; // wraps: the fraction stays
            p[axis] = domain.box.lower[axis] + size[axis] * (static_cast<double>(word >> 11) * 0x1p-53);
        }
        candidates.push(p);
        if (candidates.full()) sift();
    }
    sift();
    flush();
}

} // namespace curlew
