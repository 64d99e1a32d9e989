// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Random.h"
#include "curlew/flow/Domain.h"

namespace curlew {

/// Calls `use` with batches of the points in the domain, taken from candidates begin … end - 1 of a fixed pseudo-random
/// sequence that is uniform in its box.
template <int N, class Use>
void visitSamples(const DomainN<N>& domain, size_t begin, size_t end, const Use& use) {
    constexpr uint64_t kSeed = 0x6375726c6577; // an arbitrary constant
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
        for (int axis = 0; axis < N; ++axis)
            p[axis] = domain.box.lower[axis] + size[axis] * randomUniform(kSeed, k, static_cast<uint64_t>(axis));
        candidates.push(p);
        if (candidates.full()) sift();
    }
    sift();
    flush();
}

} // namespace curlew
