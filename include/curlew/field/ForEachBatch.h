// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Parallel.h"
#include "curlew/field/Batch.h"

namespace curlew {

/// A sequence of `count` points that are computed on demand by at(k).
template <class At>
struct PointsBy {
    size_t count;
    At at;
    size_t size() const { return count; }
    auto position(size_t k) const { return at(k); }
};
template <class At>
PointsBy(size_t, At) -> PointsBy<At>;

/// Returns position k: points.position(k) if there is such a member, as in a structure of arrays, else points[k].
template <class Positions>
auto positionOf(const Positions& points, size_t k) {
    if constexpr (requires { points.position(k); })
        return points.position(k);
    else
        return points[k];
}

namespace detail {
/// Only declared, to deduce the batch type for these positions.
template <int N>
PointBatchN<N> batchFor(const Vec<double, N>& position);
} // namespace detail

/// Returns the points begin … end - 1, at most kBatch, as a batch.
template <class Positions>
auto batchOf(const Positions& points, size_t begin, size_t end) {
    decltype(detail::batchFor(positionOf(points, begin))) batch;
    for (size_t k = begin; k < end; ++k) batch.push(positionOf(points, k));
    return batch;
}

/// Writes a batch back: points[begin + i] = batch[i], or points.setPosition(begin + i, batch[i]).
template <int N, class Positions>
void storeBatch(const PointBatchN<N>& batch, Positions& points, size_t begin) {
    for (int i = 0; i < batch.size; ++i)
        if constexpr (requires { points.setPosition(begin, batch[i]); })
            points.setPosition(begin + static_cast<size_t>(i), batch[i]);
        else
            points[begin + static_cast<size_t>(i)] = batch[i];
}

/// Calls body(batch, begin) for batches of kBatch points, on all threads; batch[i] is point begin + i. The body may
/// change the batch and move those points. Throws Interrupted if the monitor cancels, and whatever the body throws.
template <class Positions, class Body>
void forEachBatch(const Positions& points, const Body& body, const Monitor& monitor = {}) {
    parallelFor(
        points.size(), kBatch,
        [&](size_t begin, size_t end) {
            auto batch = batchOf(points, begin, end);
            body(batch, begin);
        },
        monitor);
}

/// Returns the sum of the results of body(batch, begin), added in the order of the points: the same bits for any number
/// of threads (parallelSum).
template <class Positions, class Body>
auto sumOverBatches(const Positions& points, const Body& body, const Monitor& monitor = {}) {
    return parallelSum(
        points.size(), kBatch,
        [&](size_t begin, size_t end) {
            auto batch = batchOf(points, begin, end);
            return body(batch, begin);
        },
        monitor);
}

} // namespace curlew
