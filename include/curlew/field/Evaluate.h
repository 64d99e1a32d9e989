// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Error.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/field/ScalarField.h"

#include <fmt/format.h>

#include <ranges>
#include <span>
#include <type_traits>

namespace curlew {

// These functions evaluate fields at arrays of positions, on all threads. Results go into an array of the same size.
// Its element type, float or double or a vector of them, selects the precision. They throw ValueError if the sizes
// differ, and Interrupted if the monitor cancels.

/// Positions in world units. Any contiguous array of positions converts to it.
template <int N>
using Positions = std::type_identity_t<std::span<const Vec<double, N>>>;

namespace detail {
inline void requireSameSize(size_t results, size_t positions) {
    if (results != positions)
        throw ValueError(fmt::format("{} results for {} positions; give one for each", results, positions));
}
} // namespace detail

/// values[k] = field(positions[k]).
template <int N, std::ranges::contiguous_range Values>
void evaluateValues(const ScalarFieldN<N>& field, Positions<N> positions, Values&& values,
                    const Monitor& monitor = {}) {
    using T = std::ranges::range_value_t<Values>;
    detail::requireSameSize(std::ranges::size(values), positions.size());
    forEachBatch(
        positions,
        [&](const PointBatchN<N>& points, size_t begin) {
            JetBatchN<T, N, 0> jets;
            field.eval(points, jets);
            std::copy_n(jets.c[0].begin(), points.size,
                        std::ranges::begin(values) + static_cast<std::ptrdiff_t>(begin));
        },
        monitor);
}

/// gradients[k] = ∇field(positions[k]), per world unit; gradients are Vec<float, N> or Vec<double, N>.
template <int N, std::ranges::contiguous_range Gradients>
void evaluateGradients(const ScalarFieldN<N>& field, Positions<N> positions, Gradients&& gradients,
                       const Monitor& monitor = {}) {
    using T = std::remove_cvref_t<decltype(std::ranges::begin(gradients)->c[0])>;
    detail::requireSameSize(std::ranges::size(gradients), positions.size());
    forEachBatch(
        positions,
        [&](const PointBatchN<N>& points, size_t begin) {
            JetBatchN<T, N, 1> jets;
            field.eval(points, jets);
            for (int i = 0; i < points.size; ++i)
                std::ranges::data(gradients)[begin + static_cast<size_t>(i)] = jets[i].gradient;
        },
        monitor);
}

} // namespace curlew
